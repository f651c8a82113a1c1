#pragma once

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>
#include <random>

#include "engine/surface/block_surface.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"

namespace palpate::testing {

inline void expect_same_bytes(const Mesh& a, const Mesh& b) {
    const auto same = [](const auto& x, const auto& y) {
        return x.size() == y.size() &&
               (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
    };
    ASSERT_TRUE(same(a.positions, b.positions));
    ASSERT_TRUE(same(a.normals, b.normals));
    ASSERT_TRUE(same(a.triangles, b.triangles));
}

// Whole numbers below `levels`, so that many samples are equal; uneven spacing.
inline Volume noise_volume(glm::uvec3 size, ScalarType type, int levels, uint64_t seed) {
    return make_volume(make_grid(size, {0.5, 0.75, 3.0}), type, [=](glm::uvec3 i) {
        return std::floor((synthetic::noise(i, seed) + 6.0) / 12.0 * levels);
    });
}

// A ball of up to radius samples raised, lowered, set to one value or, in floats, taken away; often
// across the border, blocks and bricks.
inline Volume random_edit(const Volume& volume, std::mt19937& random, double radius) {
    const glm::ivec3 size(volume.size());
    std::uniform_real_distribution<double> share(0.0, 1.0);
    const glm::dvec3 centre =
        glm::dvec3(share(random), share(random), share(random)) * glm::dvec3(size);
    const double r = radius * share(random);
    const int kind = static_cast<int>(random() % 4);
    const double amount = static_cast<double>(random() % 9);
    VolumeEdit edit(volume);
    const glm::ivec3 low = glm::max(glm::ivec3(glm::floor(centre - r)), glm::ivec3(0));
    const glm::ivec3 high = glm::min(glm::ivec3(glm::ceil(centre + r)), size - 1);
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x) {
                if (glm::length(glm::dvec3(x, y, z) - centre) > r)
                    continue;
                const glm::uvec3 at(x, y, z);
                const double was = edit.value(at);
                double is = amount;
                if (kind == 0)
                    is = was + amount;
                if (kind == 1)
                    is = was - amount;
                if (kind == 3 && volume.type() == ScalarType::f32)
                    is = std::numeric_limits<double>::quiet_NaN();
                edit.set(at, is);
            }
    return edit.commit();
}

// Edits one after the other, in all modes and types; after each the blocks' mesh is that of a full
// extraction, on one thread and on many.
inline void expect_incremental_equals_full(int edits, uint32_t seed) {
    std::mt19937 random(seed);
    const std::array<ScalarType, 3> types{ScalarType::f32, ScalarType::i16, ScalarType::u8};
    constexpr int kRun = 12; // edits of one volume
    for (int done = 0; done < edits; done += kRun) {
        const SurfaceOptions options{
            done / kRun % 2 == 0 ? SurfaceTopology::classic : SurfaceTopology::correct,
            random() % 4 == 0 ? SurfaceNormals::none : SurfaceNormals::gradient, random() % 3 == 0};
        const glm::uvec3 size(20 + random() % 50, 20 + random() % 30, 20 + random() % 30);
        Volume volume = noise_volume(size, types[random() % 3], 9, random());
        const float iso = random() % 2 == 0 ? 4.0f : 4.5f;
        BlockSurface surface(volume, iso, options);
        for (int e = 0; e < kRun; ++e) {
            volume = random_edit(volume, random, 12.0);
            {
                const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                                e % 2 == 0 ? 1 : 4);
                surface.update(volume);
            }
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                            e % 2 == 0 ? 4 : 1);
            expect_same_bytes(surface.mesh(), marching_cubes(volume, iso, options));
            if (::testing::Test::HasFatalFailure())
                return;
        }
    }
}

} // namespace palpate::testing
