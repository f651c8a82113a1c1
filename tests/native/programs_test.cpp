// Random functions as kernels and as plain C++, invocation by invocation:
// tests/native/make_programs.cpp. The cache variable PALPATE_NATIVE_PROGRAMS of the build makes
// more of them, and the environment variable PALPATE_ROUNDS feeds each with more numbers.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

#include "engine/native/kernel.h"
#include "programs_shaders.h"

namespace palpate {
namespace {

using uint = uint32_t;
using std::clamp, std::floor, std::max, std::min;

constexpr uint kGroups = 6, kLane = 64, kSubgroup = 8;
constexpr uint kWidth = 7, kHeight = 5; // of the picture

// Functions meet this beside their arguments.
struct World {
    std::vector<uint> picture = std::vector<uint>(kWidth * kHeight);
    std::array<uint, 24> bins{};
    std::array<uint, kGroups * kLane> kept{};
    uint invocation = 0;
};
World world;

uint texel(uint x, uint y) {
    return x < kWidth && y < kHeight ? world.picture[y * kWidth + x] : 0u;
}
uint kept() {
    return world.kept[world.invocation];
}
void keep(uint x) {
    world.kept[world.invocation] = x;
}
void bin_add(uint at, uint x) {
    world.bins[at & 3] += x;
}
void bin_or(uint at, uint x) {
    world.bins[4 + (at & 3)] |= x;
}
void bin_xor(uint at, uint x) {
    world.bins[8 + (at & 3)] ^= x;
}
void bin_and(uint at, uint x) {
    world.bins[12 + (at & 3)] &= x;
}
void bin_min(uint at, uint x) {
    world.bins[16 + (at & 3)] = min(world.bins[16 + (at & 3)], x);
}
void bin_max(uint at, uint x) {
    world.bins[20 + (at & 3)] = max(world.bins[20 + (at & 3)], x);
}

// One of these is what the lanes of a subgroup hear of each other.
enum class Said { kAdd, kInclusive, kExclusive, kFirst, kElect, kAny, kAll, kLoop };

struct Group {
    uint number;
    std::array<uint, kLane> a, b;

    template <class Function, class Condition>
    void stage(Function&& function, Condition&& condition, Said said) {
        std::array<uint, kLane> r{};
        std::array<bool, kLane> is_active{};
        for (uint lane = 0; lane < kLane; ++lane) {
            world.invocation = number * kLane + lane;
            r[lane] = function(a[lane], b[lane]);
            is_active[lane] = condition(a[lane], b[lane], r[lane]);
        }
        for (uint first = 0; first < kLane; first += kSubgroup) {
            if (said != Said::kLoop) {
                hear(first, r, is_active, said);
                continue;
            }
            for (uint i = 0; i < 3; ++i) { // lanes leave one after the other
                uint sum = 0;
                const auto goes_on = [&](uint lane) {
                    return is_active[lane] && i < (r[lane] & 3);
                };
                for (uint lane = first; lane < first + kSubgroup; ++lane)
                    sum += goes_on(lane) ? r[lane] + i : 0u;
                for (uint lane = first; lane < first + kSubgroup; ++lane)
                    a[lane] += goes_on(lane) ? sum : 0u;
            }
        }
    }

 private:
    void hear(uint first, const std::array<uint, kLane>& r,
              const std::array<bool, kLane>& is_active, Said said) {
        uint sum = 0, before = 0, lowest = kLane;
        bool any = false, all = true;
        for (uint lane = first; lane < first + kSubgroup; ++lane)
            if (is_active[lane]) {
                sum += r[lane];
                lowest = min(lowest, lane);
                any = any || (r[lane] & 2) != 0;
                all = all && (r[lane] & 2) != 0;
            }
        for (uint lane = first; lane < first + kSubgroup; ++lane)
            if (is_active[lane]) {
                const uint heard[] = {sum, before + r[lane], before, r[lowest], lane == lowest, any,
                                      all};
                a[lane] ^= heard[static_cast<size_t>(said)];
                before += r[lane];
            }
    }
};

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpragmas"
#pragma GCC diagnostic ignored "-Wtautological-compare" // random text compares what it likes
#pragma GCC diagnostic ignored "-Wtype-limits"
#pragma GCC diagnostic ignored "-Wimplicit-fallthrough"
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#include "programs_twins.h"
#pragma GCC diagnostic pop

struct Ran {
    std::vector<uint> values = std::vector<uint>(2 * kGroups * kLane), results;
    std::array<uint, 24> bins{};
    std::array<uint, kGroups * kLane> kept{};
};

// Sets the world to what the kernel begins with. The kernel runs in two pieces, as threads would
// run them.
Ran run(const native::Kernel& kernel, uint functions, uint round) {
    Ran ran;
    std::mt19937 random(7 + round);
    for (uint& value : ran.values)
        value = random() >> random() % 32;
    world = {};
    for (uint& texel : world.picture)
        texel = random();
    for (uint& bin : world.bins)
        bin = random();
    for (uint& kept : world.kept)
        kept = random();
    ran.bins = world.bins;
    ran.kept = world.kept;
    ran.results.resize(size_t{functions + 1} * kGroups * kLane);
    std::vector<std::byte> picture(4 * world.picture.size() + 128); // readable around
    std::memcpy(picture.data() + 64, world.picture.data(), 4 * world.picture.size());
    std::vector<std::byte> kept(sizeof ran.kept + 128);
    std::memcpy(kept.data() + 64, ran.kept.data(), sizeof ran.kept);
    std::array<native::Resource, 5> resources;
    const auto bind = [&](size_t at, auto& words) {
        resources[at].buffer = {reinterpret_cast<std::byte*>(words.data()), 4 * words.size()};
    };
    bind(0, ran.values);
    bind(1, ran.results);
    bind(2, ran.bins);
    const auto image = [](std::vector<std::byte>& bytes, uint width, uint height) {
        return native::Image{.texels = bytes.data() + 64,
                             .format = VK_FORMAT_R32_UINT,
                             .width = width,
                             .height = height,
                             .row_bytes = 4 * int64_t{width},
                             .slice_bytes = 4 * int64_t{width} * height};
    };
    resources[3].image = image(picture, kWidth, kHeight);
    resources[4].image = image(kept, kLane, kGroups);
    const native::Launch launch{.resources = resources, .groups = {kGroups, 1, 1}};
    kernel.run(launch, 4, kGroups - 4);
    kernel.run(launch, 0, 4);
    std::memcpy(ran.kept.data(), kept.data() + 64, sizeof ran.kept);
    return ran;
}

template <class RunAll, class RunStages>
void expect_the_same(const Shader& shader, uint functions, bool has_barrier, RunAll&& run_all,
                     RunStages&& run_stages) {
    const native::Kernel* kernel = native::find_kernel(native::hash_of(shader.code->words));
    ASSERT_TRUE(kernel) << "no kernel of " << shader.name();
    const char* wish = std::getenv("PALPATE_ROUNDS");
    const uint rounds = wish ? static_cast<uint>(std::max(1, std::atoi(wish))) : 1;
    const uint stride = functions + 1;
    for (uint round = 0; round < rounds; ++round) {
        const Ran ran = run(*kernel, functions, round);
        std::vector<uint> expected(ran.results.size());
        for (uint number = 0; number < kGroups; ++number) {
            Group group{.number = number, .a = {}, .b = {}};
            for (uint lane = 0; lane < kLane; ++lane) {
                const uint i = world.invocation = number * kLane + lane;
                group.a[lane] = ran.values[2 * i];
                group.b[lane] = ran.values[2 * i + 1];
                run_all(number, group.a[lane], group.b[lane], expected.data() + size_t{stride} * i);
            }
            for (uint lane = 0; has_barrier && lane < kLane; ++lane)
                expected[size_t{stride} * (number * kLane + lane)] =
                    group.a[(lane + 7) % kLane] ^ group.b[63 - lane];
            run_stages(group);
            for (uint lane = 0; lane < kLane; ++lane)
                expected[size_t{stride} * (number * kLane + lane) + functions] = group.a[lane];
        }
        size_t wrong = 0;
        for (size_t i = 0; i < expected.size(); ++i)
            if (ran.results[i] != expected[i] && ++wrong <= 10)
                ADD_FAILURE() << shader.name() << ", round " << round << ": f" << i % stride
                              << ", invocation " << i / stride << ": expected " << expected[i]
                              << ", found " << ran.results[i];
        EXPECT_EQ(wrong, 0u);
        EXPECT_EQ(ran.bins, world.bins) << shader.name();
        EXPECT_EQ(ran.kept, world.kept) << shader.name();
    }
}

TEST(NativePrograms, ComputeWhatPlainCodeDoes){
#include "programs_calls.h"
}

TEST(NativePrograms, ComputeWhatPlainCodeDoesWithAllLanesOfAGroupSideBySide) {
    expect_the_same(spirv::Programs0{.has_barrier = true}, programs_0::kFunctions, true,
                    programs_0::run_all, programs_0::run_stages);
}

} // namespace
} // namespace palpate
