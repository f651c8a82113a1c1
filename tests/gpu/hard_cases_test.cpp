// The hard cases of ray casting on the GPU: the list that the fp64 twin passes, and that
// `palpate bench stability` prints.

#include "tests/support/hard_cases.h"
#include "bench/cases/hard_case.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

// HardCases takes over 5 s of a processor: each of 23 cases has several pictures, for which the CPU
// driver compiles shaders.
class HardCases : public GpuTest, public testing::WithParamInterface<cases::HardCase> {};

TEST_P(HardCases, Passes) {
    static KeptForTests<cases::GpuPainter>& painter = KeptForTests<cases::GpuPainter>::make(
        [] { return std::make_unique<cases::GpuPainter>(device()); });
    expect_pass(cases::run(GetParam(), painter.get()));
}

INSTANTIATE_TEST_SUITE_P(R, HardCases, testing::ValuesIn(cases::hard_cases()), hard_case_name);

} // namespace
} // namespace palpate
