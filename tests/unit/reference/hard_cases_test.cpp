// The fp64 twin passes the hard cases of ray casting; the GPU runs the same list.

#include "tests/support/hard_cases.h"

namespace palpate {
namespace {

class HardCases : public testing::TestWithParam<cases::HardCase> {};

TEST_P(HardCases, Passes) {
    cases::TwinPainter painter;
    expect_pass(cases::run(GetParam(), painter));
}

INSTANTIATE_TEST_SUITE_P(R, HardCases, testing::ValuesIn(cases::hard_cases()), hard_case_name);

} // namespace
} // namespace palpate
