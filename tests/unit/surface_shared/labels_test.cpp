// Surface nets of real label maps: every label closed, nothing lost, nothing twice.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "engine/io/volume_io.h"
#include "engine/mesh/topology.h"
#include "engine/surface/surface_nets.h"
#include "engine/volume/builder.h"
#include "tests/support/label_volumes.h"
#include "tests/support/paths.h"

namespace palpate {
namespace {

std::map<uint16_t, uint64_t> voxel_counts(const Volume& labels) {
    std::map<uint16_t, uint64_t> counts;
    std::vector<float> row(labels.size().x);
    for (uint32_t z = 0; z < labels.size().z; ++z)
        for (uint32_t y = 0; y < labels.size().y; ++y) {
            read_row(labels, {0, y, z}, labels.size().x, row.data());
            for (const float value : row)
                ++counts[static_cast<uint16_t>(value)];
        }
    return counts;
}

// Labels and background fill the box of voxels: each is raised by one, so that background is a
// label like any other and has a surface of its own. All of it in one call.
void expect_whole(const Volume& labels, size_t label_count, uint32_t passes) {
    const Volume raised = make_volume(labels.grid(), ScalarType::u16,
                                      [&](glm::uvec3 i) { return double(labels.value(i)) + 1.0; });
    const SurfaceNetsOptions options{.passes = passes};
    const Mesh mesh = surface_nets(raised, options);
    const std::map<uint16_t, uint64_t> counts = voxel_counts(raised);
    const std::vector<LabelVolume> volumes = label_volumes(mesh);
    const std::vector<LabelVolume> twin = surface_nets_volumes_fp64(raised, options);
    ASSERT_EQ(counts.size(), label_count + 1);
    ASSERT_EQ(volumes.size(), counts.size()); // none vanishes
    ASSERT_EQ(twin.size(), counts.size());
    const double voxel_mm3 = std::abs(glm::determinant(glm::dmat3(labels.grid().world_from_index)));
    double sum = 0.0, largest_off = 0.0;
    uint64_t touching = 0;
    for (size_t n = 0; n < volumes.size(); ++n) {
        const uint16_t label = volumes[n].label;
        const double voxels_mm3 = voxel_mm3 * double(counts.at(label));
        EXPECT_GT(volumes[n].volume_mm3, 0.0) << label;
        // Positions are floats within a few hundred mm, off by 2^-16 mm at most, on both sides of
        // every voxel of the label at the worst.
        EXPECT_NEAR(volumes[n].volume_mm3, twin[n].volume_mm3,
                    6 * 0x1p-16 / std::cbrt(voxel_mm3) * voxels_mm3)
            << label;
        if (passes == 0 && counts.at(label) >= 5000) {
            EXPECT_NEAR(volumes[n].volume_mm3 / voxels_mm3, 1.0, 0.02) << label;
            largest_off = std::max(largest_off, std::abs(volumes[n].volume_mm3 / voxels_mm3 - 1));
        }
        sum += volumes[n].volume_mm3;
        const MeshTopology found = topology(surface_of_label(mesh, label));
        EXPECT_EQ(found.open_edges, 0u) << label;
        EXPECT_EQ(found.non_manifold_edges, 0u) << label;
        EXPECT_EQ(found.misoriented_edges, 0u) << label;
        EXPECT_EQ(found.duplicate_triangles + found.degenerate_triangles, 0u) << label;
        touching += found.non_manifold_vertices;
    }
    const double box = voxel_mm3 * double(sample_count(labels.grid()));
    EXPECT_NEAR(sum / box, 1.0, 1e-6);
    std::printf(
        "%zu labels, %u passes: %zu triangles, volumes sum to 1 %+.1e of the box, labels touch "
        "themselves in %llu points, of 5000 voxels or more at most %.2f %% off\n",
        label_count, passes, mesh.triangles.size(), sum / box - 1.0,
        static_cast<unsigned long long>(touching), 100.0 * largest_off);
}

// LabelSurfaces takes over 5 s of a processor: whole label maps of real organs get surfaces, and
// again in double.
class LabelSurfaces : public testing::TestWithParam<uint32_t> {};

TEST_P(LabelSurfaces, OfTheFrogFillTheBox) {
    const std::filesystem::path path =
        std::filesystem::path(kSharedData) / "labels_frog/frogtissue.mhd";
    if (!std::filesystem::exists(path))
        GTEST_SKIP() << path << " is not there";
    const Result<LoadedVolume> frog = load_labels(path);
    ASSERT_TRUE(frog) << frog.error().message;
    expect_whole(frog->volume, 25, GetParam());
}

TEST_P(LabelSurfaces, OfTheAtlasFillTheBox) {
    const std::filesystem::path path = "/usr/share/mricron/templates/aal.nii.gz";
    if (!std::filesystem::exists(path))
        GTEST_SKIP() << path << " is not there (mricron-data)";
    const Result<LoadedVolume> atlas = load_labels(path);
    ASSERT_TRUE(atlas) << atlas.error().message;
    expect_whole(atlas->volume, 116, GetParam());
}

INSTANTIATE_TEST_SUITE_P(PlainAndSmoothed, LabelSurfaces, testing::Values(0u, 10u),
                         [](const auto& test) { return std::to_string(test.param) + "_passes"; });

} // namespace
} // namespace palpate
