#include "tests/unit/haptics_falcon/codec_fuzz.h"

namespace palpate::haptics::falcon {
namespace {

TEST(FalconCodec, NoLongStreamOfBytesGivesAValueOutOfRange) {
    fuzz_codec(19, 10'000'000);
}

} // namespace
} // namespace palpate::haptics::falcon
