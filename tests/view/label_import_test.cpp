// Labels of a file for the volume that is open.

#include "apps/view/document/label_import.h"

#include <gmock/gmock.h>

#include <cmath>

#include "engine/segment/grid_change.h"
#include "engine/volume/builder.h"
#include "engine/volume/content_hash.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// A tilted grid of unlike sizes and spacings.
Grid tilted() {
    Grid grid = make_grid({7, 5, 9}, {0.8, 0.9, 2.5}, {-31, 17, 200});
    const double a = 0.3;
    const glm::dmat4 turn(std::cos(a), std::sin(a), 0, 0, -std::sin(a), std::cos(a), 0, 0, 0, 0, 1,
                          0, 0, 0, 0, 1);
    grid.world_from_index = turn * grid.world_from_index;
    return grid;
}

Volume numbered(const Grid& grid) {
    return make_volume(grid, ScalarType::u16,
                       [](glm::uvec3 i) { return 1.0 + i.x + 10.0 * i.y + 100.0 * i.z; });
}

Result<LoadedVolume> put(const Volume& labels, const Grid& grid) {
    return on_grid({labels, {}, {}, {}, {}, {}}, grid, {});
}

TEST(LabelImport, TheSameSamplesInAnotherOrderComeInThatOfTheVolume) {
    const Volume labels = numbered(tilted());
    for (const char* letters : {"RAS", "LPI", "SAR", "ILP", "PSL"}) {
        const Result<BrickMaker> other = reorient_bricks(labels, letters);
        ASSERT_TRUE(other);
        const Volume stored = *make_bricks(*other, {});
        ASSERT_NE(stored.grid(), labels.grid()) << letters;
        EXPECT_TRUE(have_same_samples(stored.grid(), labels.grid())) << letters;
        const Result<LoadedVolume> here = put(stored, labels.grid());
        ASSERT_TRUE(here) << here.error().message;
        EXPECT_EQ(here->volume.grid(), labels.grid());
        EXPECT_TRUE(here->notes.empty());
        for (uint32_t z = 0; z < 9; ++z)
            for (uint32_t y = 0; y < 5; ++y)
                for (uint32_t x = 0; x < 7; ++x)
                    ASSERT_EQ(here->volume.value({x, y, z}), labels.value({x, y, z})) << letters;
    }
}

// NIfTI keeps places as floats.
TEST(LabelImport, RoundedPlacesAreThoseOfTheVolume) {
    const Volume labels = numbered(tilted());
    Grid rounded = tilted();
    for (int column = 0; column < 4; ++column)
        rounded.world_from_index[column] = glm::dvec4(glm::vec4(rounded.world_from_index[column]));
    ASSERT_NE(rounded, labels.grid());
    const Result<LoadedVolume> here = put(with_grid(labels, rounded), labels.grid());
    ASSERT_TRUE(here) << here.error().message;
    EXPECT_EQ(here->volume.grid(), labels.grid());
    EXPECT_EQ(here->volume.value({3, 2, 4}), labels.value({3, 2, 4}));
    Grid moved = tilted(); // by 3 % of a sample
    moved.world_from_index[3] += 0.03 * moved.world_from_index[0];
    EXPECT_FALSE(have_same_samples(moved, tilted()));
}

// Corners at the same places are not enough.
TEST(LabelImport, TheSameCornersMayHaveOtherSamples) {
    const Grid wide = make_grid({8, 4, 4}, {1, 1, 1}),
               high = make_grid({4, 8, 4}, {7.0 / 3.0, 3.0 / 7.0, 1.0});
    EXPECT_FALSE(have_same_samples(high, wide));
    const Result<LoadedVolume> here = put(numbered(high), wide);
    ASSERT_TRUE(here) << here.error().message;
    EXPECT_EQ(here->volume.grid(), wide);
    EXPECT_EQ(here->notes.size(), 1u);
    EXPECT_TRUE(
        have_same_samples(make_grid({1, 5, 4}, {3, 1, 1}), make_grid({1, 5, 4}, {9, 1, 1})));
}

TEST(LabelImport, OtherSamplesComeByTheNearestAndSayIt) {
    Grid coarse = make_grid({4, 4, 4}, {2, 2, 2}, {0.5, 0.5, 0.5});
    const Volume labels =
        make_volume(coarse, ScalarType::u8, [](glm::uvec3 i) { return 1.0 + i.x; });
    const Grid fine = make_grid({8, 8, 12}, {1, 1, 1}); // beyond the labels' in the last axis
    const Result<LoadedVolume> here = put(labels, fine);
    ASSERT_TRUE(here) << here.error().message;
    ASSERT_EQ(here->notes.size(), 1u);
    EXPECT_THAT(here->notes[0], HasSubstr("other samples (4 x 4 x 4)"));
    EXPECT_EQ(here->volume.value({0, 0, 0}), 1.0f);
    EXPECT_EQ(here->volume.value({1, 7, 7}), 1.0f);
    EXPECT_EQ(here->volume.value({2, 0, 0}), 2.0f);
    EXPECT_EQ(here->volume.value({7, 0, 7}), 4.0f);
    EXPECT_EQ(here->volume.value({7, 0, 8}), 0.0f);
    Grid half = coarse; // of it lies outside
    half.world_from_index[3] -= glm::dvec4(4.5, 0, 0, 0);
    const Result<LoadedVolume> partly = put(with_grid(labels, half), fine);
    ASSERT_TRUE(partly) << partly.error().message;
    ASSERT_EQ(partly->notes.size(), 2u);
    EXPECT_THAT(partly->notes[1], StartsWith("50 % of the labels lie outside"));
    coarse.world_from_index[3] += glm::dvec4(500, 0, 0, 0);
    const Result<LoadedVolume> beside = put(with_grid(labels, coarse), fine);
    ASSERT_FALSE(beside);
    EXPECT_THAT(beside.error().message, StartsWith("the label map"));
}

class FilesBeside : public ViewerTest {
 protected:
    void open_labels(const std::string& name) { open_beside("labels", "labels/open", name); }
    void open_fused(const std::string& name) { open_beside("slices", "slices/open", name); }
    void open_beside(const std::string& section, const std::string& button,
                     const std::string& name) {
        show(section);
        click_widget(button);
        frame({});
        click_widget("browser/path", 0.5);
        frame({{.kind = Event::Kind::key, .modifiers = {.ctrl = true}, .down = true, .key = "a"}});
        frame({{.kind = Event::Kind::key, .modifiers = {.ctrl = true}, .key = "a"}});
        frame({{.kind = Event::Kind::text, .text = name}});
        key("enter");
        frame({});
        frame({});
    }
    uint64_t labels() { return content_hash(*volume(Work::kLabels)); }
    size_t steps() { return viewer().work().edited().undo_steps; }
};

// They take the place of what was drawn, as one step; what cannot be read changes nothing.
TEST_F(FilesBeside, TakeThePlaceOfWhatIsThere) {
    set_beside([](const std::string& path, bool labels) -> Result<LoadedVolume> {
        if (path != "atlas.nii" || !labels)
            return fail("{}: expected labels, found none", path);
        LoadedVolume atlas{
            numbered(make_grid({7, 5, 9}, {10, 10, 10}, {-30, -20, -40})), {}, {}, {}, {}, {}};
        atlas.labels = {{2, "heart", glm::dvec3(1.0, 0.5, 0.25)}};
        atlas.warnings = {path + ": something is odd"};
        return atlas;
    });
    open("synthetic:phantom?size=24", {800, 1400}); // the list of labels grows
    key("b");
    move(middle(Panel::axial));
    button(true);
    button(false);
    frame({});
    note_name(2, "mine");
    const uint64_t drawn = labels();
    const size_t before = steps();
    open_labels("other.nii");
    EXPECT_EQ(labels(), drawn);
    EXPECT_EQ(steps(), before);
    EXPECT_EQ(viewer().interface().message(), "other.nii: expected labels, found none");
    open_labels("atlas.nii");
    EXPECT_FALSE(state().browser_open);
    EXPECT_NE(labels(), drawn);
    EXPECT_EQ(steps(), before + 1);
    EXPECT_EQ(volume(Work::kLabels)->grid(), grid());
    EXPECT_EQ(viewer().work().name_of_label(2), "2 heart");
    EXPECT_EQ(style_of(*viewer().work().session().scene().labels, 2).color,
              glm::dvec3(1.0, 0.5, 0.25));
    EXPECT_THAT(viewer().interface().message(), HasSubstr("other samples (7 x 5 x 9)"));
    EXPECT_THAT(viewer().interface().message(), HasSubstr("something is odd"));
    key("z", {.ctrl = true});
    frame({});
    EXPECT_EQ(labels(), drawn);
    EXPECT_EQ(viewer().work().name_of_label(2), "2 mine"); // with its names and colours
    EXPECT_NE(style_of(*viewer().work().session().scene().labels, 2).color,
              glm::dvec3(1.0, 0.5, 0.25));
    key("y", {.ctrl = true});
    frame({});
    EXPECT_EQ(viewer().work().name_of_label(2), "2 heart");
    key("z", {.ctrl = true});
    frame({});
    show("appearance");
    click_widget("file/hide"); // which names of files are, too
    open_labels("atlas.nii");
    EXPECT_THAT(viewer().interface().message(), HasSubstr("labels read from the file"));
    EXPECT_EQ(viewer().interface().message().find("atlas"), std::string::npos);
    key("o", {.ctrl = true}); // is for volumes
    EXPECT_TRUE(state().browser_open);
    EXPECT_EQ(state().browsing, Browsing::documents);
}

// Another volume is drawn over slices on its own grid; one that lies elsewhere is refused.
TEST_F(FilesBeside, AnotherVolumeLiesOverTheSlices) {
    set_beside([](const std::string& path, bool labels) -> Result<LoadedVolume> {
        EXPECT_FALSE(labels);
        const glm::dvec3 origin(path == "far.nii" ? 5000.0 : -30.0, -20, -40);
        return LoadedVolume{
            numbered(make_grid({7, 5, 9}, {10, 10, 10}, origin)), {}, {}, {}, {}, {}};
    });
    open("synthetic:phantom?size=24", {800, 1600});
    const auto middle_of_axial = [&] {
        const Image shot = viewer().shot().value();
        const glm::dvec2 at = middle(Panel::axial) + glm::dvec2(9.0, 9.0);
        const size_t pixel = static_cast<size_t>(at.y) * shot.size_px.x + static_cast<size_t>(at.x);
        std::vector<float> rgb;
        for (size_t channel = 0; channel < 3; ++channel)
            rgb.push_back(shot.samples[pixel * shot.channels.size() + channel]);
        return rgb;
    };
    const std::vector<float> grey = middle_of_axial();
    EXPECT_EQ(grey[0], grey[2]);
    open_fused("far.nii");
    EXPECT_THAT(viewer().interface().message(), StartsWith("far.nii"));
    EXPECT_FALSE(viewer().work().session().scene().fusion);
    EXPECT_EQ(middle_of_axial(), grey);
    open_fused("pet.nii");
    EXPECT_TRUE(viewer().work().session().scene().fusion);
    EXPECT_EQ(steps(), 0u);
    const std::vector<float> colour = middle_of_axial();
    EXPECT_GT(colour[0], colour[2]); // black, red, yellow
    EXPECT_TRUE(viewer().interface().widgets().contains("slices/fused"));
}

} // namespace
} // namespace palpate::view
