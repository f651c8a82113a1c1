// Skipping empty space changes no bit of a picture, on thousands of scenes drawn by chance.

#include "bench/cases/skipping.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/support/hard_cases.h"

namespace palpate {
namespace {

class SkippingLong : public GpuTest, public testing::WithParamInterface<uint32_t> {};

TEST_P(SkippingLong, ChangesNoBitOfAnyPicture) {
    cases::GpuPainter painter(device());
    cases::Findings findings;
    cases::skipping_changes_nothing(painter, findings, GetParam(), 250);
    expect_pass(findings.lines());
}

INSTANTIATE_TEST_SUITE_P(Seeds, SkippingLong, testing::Range(1000u, 4000u, 250u));

} // namespace
} // namespace palpate
