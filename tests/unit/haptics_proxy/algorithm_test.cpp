#include "haptics/proxy/algorithms.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace palpate::haptics {
namespace {

TEST(Algorithms, EachIsFoundByItsOwnName) {
    std::set<std::string> names;
    for (const AlgorithmEntry& entry : algorithms()) {
        EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
        EXPECT_EQ(find_algorithm(entry.name), &entry);
        EXPECT_NE(entry.make(), nullptr) << entry.name;
    }
    EXPECT_EQ(find_algorithm("no-such-algorithm"), nullptr);
}

TEST(Algorithms, EachFeelsNothingWhereThereIsNothing) {
    const TouchScene scene;
    const TouchParameters parameters;
    for (const AlgorithmEntry& entry : algorithms()) {
        const std::unique_ptr<Algorithm> algorithm = entry.make();
        for (int i = 0; i < 10; ++i) {
            const TickOutput out = algorithm->tick({.tool = {.position_mm = glm::dvec3(i, 2, 3)},
                                                    .scene = &scene,
                                                    .parameters = &parameters});
            EXPECT_EQ(out.proxy.position_mm, glm::dvec3(i, 2, 3)) << entry.name;
            EXPECT_EQ(out.force_n, glm::dvec3(0)) << entry.name;
        }
    }
}

} // namespace
} // namespace palpate::haptics
