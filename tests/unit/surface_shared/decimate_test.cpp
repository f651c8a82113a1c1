// Decimation of a real label map with shared walls: lines, crossings and flat steps as they come.

#include <gtest/gtest.h>

#include <filesystem>

#include "engine/io/volume_io.h"
#include "engine/mesh/decimate.h"
#include "engine/mesh/topology.h"
#include "engine/surface/surface_nets.h"
#include "tests/support/paths.h"

namespace palpate {
namespace {

TEST(DecimateLabels, OfTheHippocampusStayClosedWithinTheError) {
    const std::filesystem::path path =
        std::filesystem::path(kSharedData) / "mr_hippocampus_labels/hippocampus_001_label.nii.gz";
    if (!std::filesystem::exists(path))
        GTEST_SKIP() << "the real data is absent: " << path.string();
    const Result<LoadedVolume> labels = load_labels(path);
    ASSERT_TRUE(labels) << labels.error().message;
    const Mesh mesh = surface_nets(labels->volume);
    for (const double error_mm : {0.1, 0.5}) {
        const Result<Decimated> found = decimate(mesh, {.error_mm = error_mm});
        ASSERT_TRUE(found) << found.error().message;
        EXPECT_LE(found->hausdorff_mm, error_mm);
        EXPECT_LT(found->mesh.triangles.size(), mesh.triangles.size() * 3 / 4);
        for (const uint16_t label : {1, 2}) {
            const MeshTopology before = topology(surface_of_label(mesh, label));
            const MeshTopology after = topology(surface_of_label(found->mesh, label));
            EXPECT_EQ(after.open_edges, 0u) << label;
            EXPECT_LE(after.non_manifold_edges, before.non_manifold_edges) << label;
            EXPECT_LE(after.non_manifold_vertices, before.non_manifold_vertices) << label;
            EXPECT_EQ(after.misoriented_edges, 0u) << label;
            EXPECT_EQ(after.degenerate_triangles, 0u) << label;
            EXPECT_EQ(after.euler_number, before.euler_number) << label;
            // A surface that moves by at most e encloses at most area times e more or less, to
            // first order; its area is below that of the steps.
            EXPECT_NEAR(after.volume_mm3, before.volume_mm3, 1.1 * error_mm * before.area_mm2)
                << label;
        }
    }
}

} // namespace
} // namespace palpate
