// Marks of figures: where they lie, what they say, and what they look like.

#include "engine/annotate/figure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>

#include "engine/annotate/measure.h"
#include "engine/annotate/strokes.h"
#include "engine/image/png.h"
#include "tests/support/paths.h"

namespace palpate {
namespace {

constexpr glm::uvec2 kSize(320, 240);

// A camera that sees these world directions to the right and up.
Camera camera_with(glm::dvec3 right, glm::dvec3 up, Projection projection) {
    Camera camera;
    camera.projection = projection;
    camera.target_mm = {3, -5, 11};
    camera.eye_mm = camera.target_mm - 300.0 * glm::cross(up, right);
    camera.up = up;
    camera.view_height_mm = 150.0;
    return camera;
}

Image marked(const Camera& camera, const Figure& figure, glm::uvec2 size = kSize) {
    Scene scene;
    scene.size_px = size;
    scene.camera = camera;
    Image image = make_image(size, {"R", "G", "B", "A"});
    annotate(std::span(&image, 1), scene, figure);
    return image;
}

// The letters of the right, upper, left and lower edge, as a picture of them alone.
Image letters_at(const std::array<std::string, 4>& letters) {
    Image image = make_image(kSize, {"R", "G", "B", "A"});
    const Pen pen{1.3 * 20.0, glm::dvec3(1.0), glm::dvec3(0.0)};
    const double edge = 12.0, w = kSize.x, h = kSize.y;
    draw_text(image, {edge, 0.5 * h}, {0.0, 0.5}, letters[2], pen);
    draw_text(image, {w - edge, 0.5 * h}, {1.0, 0.5}, letters[0], pen);
    draw_text(image, {0.5 * w, edge}, {0.5, 0.0}, letters[1], pen);
    draw_text(image, {0.5 * w, h - edge}, {0.5, 1.0}, letters[3], pen);
    return image;
}

// All 24 ways to look along the patient's axes, by a table of names.
TEST(Figure, LettersAreRightForAll24ViewsAlongTheAxes) {
    struct Side {
        const char *letter, *opposite;
        glm::dvec3 direction;
    };
    const Side sides[] = {{"L", "R", {1, 0, 0}},  {"R", "L", {-1, 0, 0}}, {"P", "A", {0, 1, 0}},
                          {"A", "P", {0, -1, 0}}, {"S", "I", {0, 0, 1}},  {"I", "S", {0, 0, -1}}};
    int views = 0;
    for (const Side& right : sides)
        for (const Side& up : sides)
            if (glm::dot(right.direction, up.direction) == 0.0) {
                ++views;
                const Image expected =
                    letters_at({right.letter, up.letter, right.opposite, up.opposite});
                for (const Projection p : {Projection::orthographic, Projection::perspective}) {
                    const Image found = marked(camera_with(right.direction, up.direction, p),
                                               {.letters = true, .line_px = 20.0});
                    EXPECT_EQ(found.samples, expected.samples) << right.letter << up.letter;
                }
            }
    EXPECT_EQ(views, 24);
}

// The letter at an edge of an oblique view names where the picture's points lie there: those of a
// point at that edge, seen from the picture's middle.
TEST(Figure, LettersAreRightForObliqueViews) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 50; ++i) {
        Camera camera;
        camera.projection = i % 2 ? Projection::orthographic : Projection::perspective;
        camera.target_mm = {normal(random), normal(random), normal(random)};
        camera.eye_mm =
            camera.target_mm +
            200.0 * glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
        camera.up = {normal(random), normal(random), normal(random)};
        const View view = make_view(camera, kSize);
        const glm::dvec2 middle = 0.5 * glm::dvec2(kSize) - 0.5;
        const auto towards = [&](glm::dvec2 step) { // in the plane through the target
            const auto point = [&](glm::dvec2 pixel) {
                const Ray ray = ray_through(view, pixel, kSize);
                return ray.origin_mm +
                       ray.direction * (glm::dot(camera.target_mm - ray.origin_mm, view.forward) /
                                        glm::dot(ray.direction, view.forward));
            };
            return letters_of(point(middle + step) - point(middle));
        };
        const Image expected =
            letters_at({towards({50, 0}), towards({0, -50}), towards({-50, 0}), towards({0, 50})});
        const Image found = marked(camera, {.letters = true, .line_px = 20.0});
        EXPECT_EQ(found.samples, expected.samples) << i;
    }
}

// The bar is as long as the picture of its length in the focal plane.
TEST(Figure, TheScaleBarIsAsLongAsItSays) {
    std::mt19937 random(8);
    std::uniform_real_distribution<double> real(0.0, 1.0);
    for (int i = 0; i < 200; ++i) {
        const glm::uvec2 size(200 + random() % 800, 150 + random() % 600);
        Camera camera = camera_with({1, 0, 0}, {0, 0, 1},
                                    i % 2 ? Projection::orthographic : Projection::perspective);
        camera.view_height_mm = 1.0 + 400.0 * real(random);
        camera.view_angle_deg = 5.0 + 90.0 * real(random);
        const double line = 16.0, edge = std::round(0.6 * line);
        const Image image = marked(camera, {.scale_bar = true, .line_px = line}, size);
        // White on black in the middle of its height; the rim is black.
        const auto row = static_cast<uint32_t>(size.y - edge - 0.1 * line);
        double found_px = 0.0;
        for (uint32_t x = 0; x < size.x; ++x)
            found_px += double(image.at(x, row, 0));
        const double mm = scale_bar(mm_per_px(camera, size), 0.3 * size.x).mm;
        const View view = make_view(camera, size);
        const auto x_of = [&](double at_mm) { // of a point of the focal plane
            const glm::dvec3 arm = camera.target_mm + at_mm * view.right - view.eye_mm;
            const double ahead =
                camera.projection == Projection::perspective ? glm::dot(arm, view.forward) : 1.0;
            return (glm::dot(arm, view.right) / ahead - view.left) / (view.right_edge - view.left) *
                   size.x;
        };
        // Floats of 300 pixels at most.
        EXPECT_NEAR(found_px, x_of(0.5 * mm) - x_of(-0.5 * mm), 1e-3) << i;
    }
}

Scene slice_scene() {
    Scene scene;
    scene.size_px = {360, 280};
    scene.camera = camera_with({1, 0, 0}, {0, -1, 0}, Projection::orthographic);
    scene.slices = {{.point_mm = {0, 0, 12.5}, .normal = {0, 0, 1}, .slab_mm = 5.0}};
    scene.slice_transfer = window_function(-160.0, 240.0, 1.0);
    return scene;
}

// Each row of the colour bar has the colour of its value, and ticks lie at theirs.
TEST(Figure, TheColourBarHasTheColoursOfItsValues) {
    Scene scene = slice_scene();
    scene.slice_transfer.colors = {{-100, {0, 0, 1}}, {50, {0, 1, 0}}, {200, {1, 0, 0}}};
    Image image = make_image(scene.size_px, {"R", "G", "B"});
    const double line = 14.0, edge = 8.0;
    annotate(std::span(&image, 1), scene, {.color_bar = true, .line_px = line});
    const auto x = static_cast<uint32_t>(scene.size_px.x - edge - 4.0);
    const double low = edge, high = std::floor(0.44 * scene.size_px.y);
    for (double y = low; y < high; ++y) {
        const double value = 200.0 - 300.0 * (y + 0.5 - low) / (high - low);
        for (size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(image.at(x, static_cast<uint32_t>(y), c),
                        color_at(scene.slice_transfer, value)[static_cast<glm::length_t>(c)], 1e-6)
                << y;
    }
    scene.slices.clear();
    EXPECT_EQ(color_function(scene), nullptr);
    scene.ray_cast.emplace();
    scene.ray_cast->transfer = window_function(0, 100, 0.1);
    EXPECT_EQ(color_function(scene), &scene.ray_cast->transfer);
    scene.ray_cast->mode = RayMode::iso;
    EXPECT_EQ(color_function(scene), nullptr);
}

TEST(Figure, ANoteTellsNameSliceAndWindow) {
    const Grid grid = make_grid({10, 10, 31}, {1, 1, 2.5}, {0, 0, -25});
    Scene scene = slice_scene();
    EXPECT_EQ(
        note_of(scene, grid, "head.nii", "HU"),
        (std::vector<std::string>{"head.nii", "S 12.5 mm, 16 of 31, slab 5 mm", "W 400 L 40"}));
    scene.slices.clear();
    scene.ray_cast.emplace();
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{-300.0}, {300.0}};
    EXPECT_EQ(note_of(scene, grid, "head.nii", "HU"),
              (std::vector<std::string>{"head.nii", "iso -300, 300 HU"}));
    EXPECT_EQ(note_of(scene, grid, "x", "").back(), "iso -300, 300");
}

// Nothing is written outside small pictures, whatever is asked for.
TEST(Figure, SmallPicturesAreMarkedAsFarAsThereIsRoom) {
    for (const uint32_t side : {1u, 2u, 9u, 40u}) {
        Scene scene = slice_scene();
        Image image = make_image({side, side}, {"R", "G", "B", "A"});
        annotate(std::span(&image, 1), scene, {true, true, true, {"a long note"}, {}, "HU"});
        for (const float v : image.samples)
            EXPECT_TRUE(v >= 0.0f && v <= 1.0f);
    }
}

// Each mark takes the ink that stands out from what it covers; both eyes take the same.
TEST(Figure, InkStandsOutFromWhatItCovers) {
    const Scene scene = slice_scene();
    std::array<Image, 2> eyes{make_image({200, 200}, {"R", "G", "B", "A"}),
                              make_image({200, 200}, {"R", "G", "B", "A"})};
    for (uint32_t y = 0; y < 200; ++y) // the left half of the left eye is bright
        for (uint32_t x = 0; x < 100; ++x)
            for (size_t c = 0; c < 3; ++c)
                eyes[0].at(x, y, c) = 0.9f;
    annotate(eyes, scene, {.letters = true, .line_px = 30.0});
    float darkest = 1.0f, brightest = 0.0f;
    for (uint32_t y = 90; y < 110; ++y)
        for (uint32_t x = 10; x < 50; ++x) {
            darkest = std::min(darkest, eyes[0].at(x, y, 0));
            brightest = std::max(brightest, eyes[0].at(199 - x, y, 0));
        }
    EXPECT_EQ(darkest, 0.0f);
    EXPECT_EQ(brightest, 1.0f);
    const auto alone = [&](FigureInk ink, bool transparent) {
        Image image = make_image({200, 200}, {"R", "G", "B", "A"});
        annotate(std::span(&image, 1), scene,
                 {.letters = true, .ink = ink, .transparent = transparent, .line_px = 30.0});
        return image;
    };
    const Image dark = alone(FigureInk::dark, false);
    for (uint32_t y = 90; y < 110; ++y)
        for (uint32_t x = 10; x < 50; ++x)
            EXPECT_EQ(eyes[1].at(x, y, 0), dark.at(x, y, 0));
    // On a transparent picture it stands out from a bright page.
    EXPECT_EQ(alone(FigureInk::by_picture, true).samples, dark.samples);
    EXPECT_EQ(alone(FigureInk::by_picture, false).samples, alone(FigureInk::bright, false).samples);
}

TEST(Figure, ALongNoteEndsBeforeTheMiddle) {
    const Scene scene = slice_scene();
    Image image = make_image({300, 200}, {"R", "G", "B"});
    annotate(std::span(&image, 1), scene,
             {.note = {std::string(200, 'W'), "short"}, .line_px = 14.0});
    for (uint32_t y = 0; y < 200; ++y)
        for (uint32_t x = 140; x < 300; ++x)
            EXPECT_EQ(image.at(x, y, 0), 0.0f);
}

// The marks as a person sees them. PALPATE_BLESS=1 writes the pictures; look at them before.
TEST(Figure, LooksAsItDid) {
    struct Case {
        const char* name;
        glm::dvec3 right, up;
        Projection projection;
        bool bright;
    };
    for (const Case& c : {Case{"axial", {1, 0, 0}, {0, -1, 0}, Projection::orthographic, false},
                          {"white", {0.8, 0.6, 0}, {0, 0, 1}, Projection::perspective, true}}) {
        Scene scene = slice_scene();
        scene.camera = camera_with(c.right, c.up, c.projection);
        if (c.bright)
            scene.slice_transfer.colors = {
                {-1000, {0.2, 0, 0.4}}, {0, {0.9, 0.4, 0.2}}, {1500, {1, 1, 0.8}}};
        Image image = make_image(scene.size_px, {"R", "G", "B"});
        for (uint32_t y = 0; y < image.size_px.y; ++y)
            for (uint32_t x = 0; x < image.size_px.x; ++x) {
                const glm::dvec2 p = (glm::dvec2(x, y) - 0.5 * glm::dvec2(image.size_px)) / 120.0;
                const bool inside = glm::dot(p, p) < 1.0;
                for (size_t k = 0; k < 3; ++k)
                    image.at(x, y, k) = inside ? float(0.35 + 0.3 * p.x) : c.bright ? 1.0f : 0.0f;
            }
        annotate(std::span(&image, 1), scene,
                 {.letters = true,
                  .scale_bar = true,
                  .color_bar = true,
                  .note = {"Cranium (1).inv3", "S 12.5 mm, 46 of 108", "W 400 L 40"},
                  .unit = "HU",
                  .line_px = 15.0});
        const std::string path =
            std::string(kSourceDir) + "/tests/unit/annotate/" + c.name + ".png";
        if (std::getenv("PALPATE_BLESS")) {
            ASSERT_TRUE(save_png(path, image));
        }
        const Result<Image> golden = load_png(path);
        ASSERT_TRUE(golden) << golden.error().message;
        ASSERT_EQ(golden->size_px, image.size_px);
        for (size_t i = 0; i < image.samples.size(); ++i) // one step of 8 bits, for sine's last bit
            ASSERT_NEAR(image.samples[i], golden->samples[i], 1.6 / 255.0) << c.name << " " << i;
    }
}

// Patches of colour that are seen in a picture with a legend of so many entries.
size_t patches(size_t entries, glm::uvec2 size) {
    Figure figure;
    std::vector<glm::dvec3> colors;
    for (size_t i = 0; i < entries; ++i) {
        colors.emplace_back(0.2 + 0.7 * double(i % 13) / 13.0, 0.1 + 0.05 * double(i / 13), 0.5);
        figure.legend.push_back({fmt::format("region {}", i), colors.back()});
    }
    const Image image =
        marked(camera_with({1, 0, 0}, {0, 0, 1}, Projection::orthographic), figure, size);
    size_t seen = 0;
    for (const glm::dvec3 color : colors) {
        bool found = false;
        for (uint32_t y = 0; y < size.y && !found; ++y)
            for (uint32_t x = 0; x < size.x && !found; ++x)
                found = glm::distance(
                            glm::dvec3(image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)),
                            color) < 1e-3;
        seen += found;
    }
    return seen;
}

// 1/26 of the height makes 10 rows of a column; more entries go into further columns, and then into
// smaller letters.
TEST(Figure, ALegendListsAllEntriesInColumnsBeforeItCountsTheRest) {
    constexpr glm::uvec2 size(1600, 1200);
    for (const size_t entries : {1u, 10u, 11u, 40u, 60u})
        EXPECT_EQ(patches(entries, size), entries);
    const size_t most = patches(200, size);
    EXPECT_GT(most, 60u);
    EXPECT_LT(most, 200u); // "and .. more"
}

} // namespace
} // namespace palpate
