#include "tests/unit/haptics_proxy/fuzz.h"

namespace palpate::haptics {
namespace {

TEST(Fuzz, NoInputGivesAnythingButNumbers) {
    const FuzzScenes scenes;
    for (const AlgorithmEntry& entry : algorithms())
        fuzz_algorithm(entry, scenes, 5, 3000);
}

} // namespace
} // namespace palpate::haptics
