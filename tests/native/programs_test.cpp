// Random functions as kernels and as plain C++, invocation by invocation:
// tests/native/make_programs.cpp.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "engine/native/kernel.h"
#include "spirv/programs_1.h"
#include "spirv/programs_2.h"
#include "spirv/programs_3.h"

namespace palpate {
namespace {

using uint = uint32_t;
using std::clamp, std::floor, std::max, std::min;

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpragmas"
#pragma GCC diagnostic ignored "-Wtautological-compare" // random text compares what it likes
#pragma GCC diagnostic ignored "-Wtype-limits"
#pragma GCC diagnostic ignored "-Wimplicit-fallthrough"
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
namespace one {
#include "programs_1_twin.h"
}
namespace two {
#include "programs_2_twin.h"
}
namespace three {
#include "programs_3_twin.h"
}
#pragma GCC diagnostic pop

constexpr uint kGroups = 6, kLane = 64;

struct Ran {
    std::vector<uint> values = std::vector<uint>(2 * kGroups * kLane), results,
                      bins = std::vector<uint>(16);
};

// In two pieces, as threads would run them.
Ran run(const Shader& shader, uint functions) {
    const native::Kernel* kernel = native::find_kernel(native::hash_of(shader.code->words));
    Ran ran;
    if (!kernel) {
        ADD_FAILURE() << "no kernel of " << shader.name();
        return ran;
    }
    std::mt19937 random(7);
    for (uint& value : ran.values)
        value = random() >> random() % 32;
    ran.results.resize(size_t{functions} * kGroups * kLane);
    std::array<native::Resource, 3> resources;
    const auto bind = [&](size_t at, std::vector<uint>& words) {
        resources[at].buffer = {reinterpret_cast<std::byte*>(words.data()), 4 * words.size()};
    };
    bind(0, ran.values);
    bind(1, ran.results);
    bind(2, ran.bins);
    const native::Launch launch{.resources = resources, .groups = {kGroups, 1, 1}};
    kernel->run(launch, 4, kGroups - 4);
    kernel->run(launch, 0, 4);
    return ran;
}

template <class RunAll>
void expect_the_same(const Shader& shader, uint functions, bool has_barrier, RunAll&& run_all) {
    const Ran ran = run(shader, functions);
    if (ran.results.empty())
        return;
    std::vector<uint> expected(functions), bins(16);
    size_t wrong = 0;
    for (uint i = 0; i < kGroups * kLane; ++i) {
        const uint a = ran.values[2 * i], b = ran.values[2 * i + 1];
        run_all(i / kLane, a, b, expected.data());
        bins[a & 15] += b;
        if (has_barrier) {
            const uint first = i / kLane * kLane, lane = i % kLane;
            expected[0] = ran.values[2 * (first + (lane + 7) % kLane)] ^
                          ran.values[2 * (first + 63 - lane) + 1];
        }
        for (uint f = 0; f < functions; ++f)
            if (ran.results[size_t{functions} * i + f] != expected[f] && ++wrong <= 10)
                ADD_FAILURE() << shader.name() << ": f" << f << "(" << a << ", " << b
                              << "), invocation " << i << ": expected " << expected[f] << ", found "
                              << ran.results[size_t{functions} * i + f];
    }
    EXPECT_EQ(wrong, 0u);
    EXPECT_EQ(ran.bins, bins);
}

TEST(NativePrograms, ComputeWhatPlainCodeDoes) {
    expect_the_same(spirv::Programs1{}, one::kFunctions, false, one::run_all);
    expect_the_same(spirv::Programs2{}, two::kFunctions, false, two::run_all);
    expect_the_same(spirv::Programs3{}, three::kFunctions, false, three::run_all);
}

TEST(NativePrograms, ComputeWhatPlainCodeDoesWithAllLanesOfAGroupSideBySide) {
    expect_the_same(spirv::Programs3{.has_barrier = true}, three::kFunctions, true, three::run_all);
}

} // namespace
} // namespace palpate
