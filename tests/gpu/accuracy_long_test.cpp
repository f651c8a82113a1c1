// The bound of `--error` is kept, on a thousand scenes drawn by chance.

#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/random_accuracy.h"

namespace palpate {
namespace {

class AccuracyLong : public GpuTest, public testing::WithParamInterface<uint32_t> {};

TEST_P(AccuracyLong, RandomScenesErrLessThanGranted) {
    expect_promises_kept(device(), GetParam(), 50);
}

INSTANTIATE_TEST_SUITE_P(Seeds, AccuracyLong, testing::Range(2000000u, 2001000u, 50u));

} // namespace
} // namespace palpate
