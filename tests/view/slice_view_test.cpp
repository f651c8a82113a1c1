// Tests of the places of slices on the screen and in the patient.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/view/subjects.h"

namespace palpate::view {
namespace {

constexpr Panel kSlices[] = {Panel::axial, Panel::coronal, Panel::sagittal};

TEST(SliceView, AxesAreRightHandedAndNearThePatientsOnAnyGrid) {
    std::mt19937 random(1);
    for (int i = 0; i < 200; ++i) {
        const Grid grid = random_grid(random);
        const auto views = slice_views(grid);
        for (const SliceView& view : views) {
            EXPECT_NEAR(glm::length(view.right), 1.0, 1e-12);
            EXPECT_NEAR(glm::length(glm::cross(view.right, view.up) - view.towards), 0.0, 1e-12);
        }
        // No other choice of the grid's axes is nearer to left, posterior and superior.
        const double near = views[0].right.x - views[0].up.y - views[0].towards.z;
        const glm::dmat3 m(grid.world_from_index);
        std::array<int, 3> order{0, 1, 2};
        do {
            double sum = 0.0;
            for (int axis = 0; axis < 3; ++axis)
                sum += std::abs(glm::normalize(m[order[static_cast<size_t>(axis)]])[axis]);
            EXPECT_LE(sum, near + 1e-9);
        } while (std::next_permutation(order.begin(), order.end()));
        EXPECT_EQ(views[0].up, -views[2].right);
        EXPECT_EQ(views[1].up, -views[0].towards);
    }
}

TEST(SliceView, OfAGridAlongThePatientRadiologistsSeeTheirUsualSides) {
    const auto views = slice_views(make_grid(glm::uvec3(10, 20, 30), glm::dvec3(1, 2, 3)));
    const auto sides = [](const SliceView& v) {
        return letters_of(-v.right) + letters_of(v.right) + letters_of(v.up) + letters_of(-v.up);
    };
    EXPECT_EQ(sides(views[0]), "RLAP");
    EXPECT_EQ(sides(views[1]), "RLSI");
    EXPECT_EQ(sides(views[2]), "APSI");
}

// point_under() and pixel_of() say the same as the camera that the picture is drawn with.
TEST(SliceView, APixelsPointIsWhereTheCamerasRayMeetsThePlane) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> real(0.0, 1.0);
    for (int i = 0; i < 300; ++i) {
        const Grid grid = random_grid(random);
        SliceView view = slice_views(grid)[random() % 3];
        view.zoom = 0.5 + 3.0 * real(random);
        view.center_mm += 20.0 * glm::dvec3(real(random), real(random), real(random));
        const glm::dvec3 crosshair = world_point(
            grid, glm::dvec3(grid.size) * glm::dvec3(real(random), real(random), real(random)));
        const glm::ivec2 size(50 + random() % 500, 50 + random() % 500);
        const glm::dvec2 pixel = glm::dvec2(size) * glm::dvec2(real(random), real(random));
        const Camera camera = camera_of(view, crosshair, grid, size);
        const Ray ray = ray_through(make_view(camera, glm::uvec2(size)), pixel, glm::uvec2(size));
        const double t = glm::dot(crosshair - ray.origin_mm, view.towards) /
                         glm::dot(ray.direction, view.towards);
        EXPECT_GT(t, 0.0);
        const glm::dvec3 met = ray.origin_mm + t * ray.direction;
        // Doubles of some 1e3 mm: 1e-9 is a thousand roundings.
        const glm::dvec3 point = point_under(view, crosshair, grid, size, pixel);
        EXPECT_LT(glm::distance(met, point), 1e-9);
        EXPECT_LT(glm::distance(pixel_of(view, grid, size, point), pixel), 1e-8);
        EXPECT_LT(glm::distance(pixel_of(camera, size, point).value(), pixel), 1e-8);
    }
}

// So a slice is not drawn anew while the crosshair moves in it.
TEST(SliceView, ACrosshairThatMovesInAPlaneLeavesItsSliceTheSame) {
    std::mt19937 random(9);
    std::uniform_real_distribution<double> mm(-40.0, 40.0);
    for (int i = 0; i < 100; ++i) {
        ViewState state = subject_of(random_grid(random)).home;
        const Grid grid = random_grid(random);
        state.slices = slice_views(grid);
        const Panel panel = kSlices[random() % 3];
        const SliceView& view = state.slices[static_cast<size_t>(panel)];
        state.crosshair_mm = {mm(random), mm(random), mm(random)};
        const Scene before = scene_of(state, grid, panel, Scene{}, false);
        const glm::dvec3 from = state.crosshair_mm;
        state.crosshair_mm = from + mm(random) * view.right + mm(random) * view.up;
        EXPECT_TRUE(scene_of(state, grid, panel, Scene{}, false) == before) << i;
        state.crosshair_mm = from + 1e-6 * view.towards;
        EXPECT_FALSE(scene_of(state, grid, panel, Scene{}, false) == before) << i;
    }
}

// They are one live surface behind those of the scene, and rays have no tint then.
TEST(LabelsIn3D, AreASurfaceBesideTheRaysOrTintThem) {
    std::mt19937 random(2);
    const Grid grid = random_grid(random);
    ViewState state = subject_of(grid).home;
    Scene base;
    base.ray_cast.emplace();
    base.labels.emplace();
    base.surfaces.resize(1);
    const auto scene = [&](Panel panel, bool has_labels) {
        return scene_of(state, grid, panel, base, has_labels);
    };
    const Scene shown = scene(Panel::volume, true);
    ASSERT_EQ(shown.surfaces.size(), 2u);
    EXPECT_TRUE(shown.surfaces[1].live_labels);
    EXPECT_EQ(shown.labels->ray_cast_weight, 0.0);
    EXPECT_TRUE(scene(Panel::axial, true).surfaces.empty());
    EXPECT_EQ(scene(Panel::volume, false).surfaces.size(), 1u);
    base.surfaces.resize(kMaxSurfaces);
    EXPECT_EQ(scene(Panel::volume, true).labels->ray_cast_weight, LabelLayer{}.ray_cast_weight)
        << "no room for one more";
    base.surfaces.resize(1);
    state.labels_in_3d = false;
    EXPECT_EQ(scene(Panel::volume, true).surfaces.size(), 1u);
    EXPECT_EQ(scene(Panel::volume, true).labels->ray_cast_weight, LabelLayer{}.ray_cast_weight);
    base.surfaces[0].live_labels = true; // of a label map that was opened alone
    EXPECT_EQ(scene(Panel::volume, true).surfaces[0].style.opacity, 0.0);
    state.labels_in_3d = true;
    EXPECT_EQ(scene(Panel::volume, true).surfaces.size(), 1u);
    state.labels_shown = false;
    EXPECT_FALSE(scene(Panel::volume, true).labels);
}

TEST(SliceView, TheWholeVolumeFitsAtZoomOneAndTouchesTheRoom) {
    std::mt19937 random(4);
    for (int i = 0; i < 100; ++i) {
        const Grid grid = random_grid(random);
        const glm::ivec2 size(100 + random() % 400, 100 + random() % 400);
        for (const SliceView& view : slice_views(grid)) {
            glm::dvec2 low(INFINITY), high(-INFINITY);
            for (int corner = 0; corner < 8; ++corner) {
                const glm::dvec3 index =
                    glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * glm::dvec3(grid.size) -
                    0.5;
                const glm::dvec2 at = pixel_of(view, grid, size, world_point(grid, index));
                low = glm::min(low, at);
                high = glm::max(high, at);
            }
            const glm::dvec2 share = (high - low) / glm::dvec2(size);
            EXPECT_NEAR(std::max(share.x, share.y), 1.0 / 1.04, 1e-9);
        }
    }
}

TEST(Places, PanelsFillTheWindowAndDoNotOverlap) {
    std::mt19937 random(5);
    for (int i = 0; i < 500; ++i) {
        const glm::uvec2 window(kSmallestWindow_px.x + random() % 2000,
                                kSmallestWindow_px.y + random() % 1200);
        const auto layout = static_cast<Layout>(random() % 3);
        const std::optional<Panel> alone =
            random() % 3 ? std::nullopt : std::optional(kPanels[random() % 4]);
        OpenPanels open{random() % 2 != 0, random() % 2 != 0, random() % 4 != 0};
        open.foot_px = random() % 2 ? kFoot_px : 0.0;
        const double text_scale = 0.5 + 0.25 * static_cast<double>(random() % 15);
        const Places places =
            places_of(window, layout, kSlices[random() % 3], alone, open, text_scale);
        EXPECT_EQ(places.tools.size_px.x > 0, open.tools);
        EXPECT_EQ(places.touch.size_px.x > 0, open.touch);
        EXPECT_EQ(places.bar.size_px.x > 0, open.bars);
        int64_t area = 0;
        std::vector<Box> boxes{places.tools,  places.foot, places.touch,
                               places.status, places.bar,  places.top};
        for (const Places::View& view : places.views)
            boxes.push_back(view.box);
        for (size_t a = 0; a < boxes.size(); ++a) {
            area += int64_t{boxes[a].size_px.x} * boxes[a].size_px.y;
            EXPECT_TRUE(boxes[a].low_px.x >= 0 && boxes[a].low_px.y >= 0);
            for (size_t b = 0; b < a; ++b) {
                const glm::ivec2 low = glm::max(boxes[a].low_px, boxes[b].low_px);
                const glm::ivec2 high = glm::min(boxes[a].low_px + boxes[a].size_px,
                                                 boxes[b].low_px + boxes[b].size_px);
                EXPECT_TRUE(high.x <= low.x || high.y <= low.y);
            }
        }
        glm::i64vec2 low(window), high(0); // of all views
        for (const Places::View& view : places.views) {
            low = glm::min(low, glm::i64vec2(view.box.low_px));
            high = glm::max(high, glm::i64vec2(view.box.low_px + view.box.size_px));
        }
        const glm::i64vec2 room = high - low;
        const glm::uvec2 bars = open.bars ? bars_px(window, text_scale) : glm::uvec2(0);
        EXPECT_GE(room.x, (window.x - bars.x) / 2);
        const int64_t round = open.bars ? kGap_px : 0;
        const int64_t between =
            places.views.size() == 4 ? kGap_px * (room.x + room.y - kGap_px) : 0;
        const int64_t gaps = 2 * round * (room.x + room.y + 2 * round) + between;
        EXPECT_EQ(area, int64_t{window.x} * window.y - gaps);
    }
}

// World is left, posterior, superior: each number has the side of its sign.
TEST(PatientText, HasTheSideOfEachNumber) {
    EXPECT_EQ(patient_text({12.4, 88.0, 262.3}), "L 12.4  P 88.0  S 262.3 mm");
    EXPECT_EQ(patient_text({-12.4, -88.0, -262.3}), "R 12.4  A 88.0  I 262.3 mm");
    EXPECT_EQ(patient_text({-0.04, 0.0, -0.06}), "L 0.0  P 0.0  I 0.1 mm");
}

} // namespace
} // namespace palpate::view
