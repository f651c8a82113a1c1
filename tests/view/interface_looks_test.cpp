// The interface as a person sees it: pictures of whole windows in both themes, and letters that are
// neither cut off nor drawn upon each other.

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "engine/image/png.h"
#include "tests/support/paths.h"
#include "tests/view/drawn_text.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

struct WindowLooks {
    bool light;
    glm::uvec2 size_px;
};

class InterfaceGolden : public ViewerTest, public ::testing::WithParamInterface<WindowLooks> {};

// The task with most kinds of widgets: labels with long names, one that is hidden and one that is
// locked, sliders, fields, boxes, lists and the button that runs a method. Views are black: they
// have goldens of their own. PALPATE_BLESS=1 writes the pictures anew: the commit says what has
// changed in them.
TEST_P(InterfaceGolden, LooksAsItDid) {
    const auto [light, size] = GetParam();
    Settings settings;
    settings.light = light;
    set_settings(settings);
    open_window(Source{open_synthetic("synthetic:phantom?size=8")}, size);
    note_name(1, "liver");
    note_name(2, "portal vein and splenic vein");
    note_name(3, "left kidney");
    take_task(WindowTask::segment);
    click_widget("labels/visible/2");
    click_widget("labels/lock/3");
    click_widget("tool/draw");
    move(middle(Panel::volume));
    frame({}, 60.0); // messages have been read
    frame({});
    Image shot = viewer().shot().value();
    for (const Places::View& view : places_of(state()).views)
        for (int y = 0; y < view.box.size_px.y; ++y)
            for (int x = 0; x < view.box.size_px.x; ++x)
                for (size_t c = 0; c < 3; ++c)
                    shot.at(static_cast<uint32_t>(view.box.low_px.x + x),
                            static_cast<uint32_t>(view.box.low_px.y + y), c) = 0.0f;
    // Each version of ImGui places letters in its own way.
    const std::string path = fmt::format("{}/tests/view/interface_{}_{}_imgui_{}.png", kSourceDir,
                                         light ? "light" : "dark", size.y, IMGUI_VERSION);
    if (std::getenv("PALPATE_BLESS")) {
        ASSERT_TRUE(save_png(path, shot));
    }
    if (!std::filesystem::exists(path))
        GTEST_SKIP() << path << " is not there: PALPATE_BLESS=1 writes it, to be looked at";
    const Image golden = load_png(path).value();
    ASSERT_EQ(golden.size_px, shot.size_px);
    size_t others = 0;
    for (uint32_t y = 0; y < shot.size_px.y; ++y)
        for (uint32_t x = 0; x < shot.size_px.x; ++x)
            for (size_t c = 0; c < 3; ++c) // one step of 8 bits: blending rounds a tie either way
                others += std::abs(shot.at(x, y, c) - golden.at(x, y, c)) > 1.5f / 255.0f;
    EXPECT_EQ(others, 0u);
}

INSTANTIATE_TEST_SUITE_P(
    Window, InterfaceGolden,
    ::testing::Values(WindowLooks{false, {1280, 720}}, WindowLooks{true, {1280, 720}},
                      WindowLooks{false, {1920, 1080}}, WindowLooks{true, {1920, 1080}}),
    [](const auto& each) {
        return fmt::format("{}_{}", each.param.light ? "light" : "dark", each.param.size_px.y);
    });

// Letters of all panels, sections open, in windows and sizes of letters that people have. Expected:
// each is drawn whole from left to right, and none lies upon another one.
class InterfaceLetters : public ViewerTest {
 protected:
    // The letter is seen, though perhaps not all of it: a scrolled panel hides the others.
    static bool is_seen(const DrawnLetter& one) {
        return one.low.y >= one.clip.y && one.high.y <= one.clip.w;
    }
    static std::string at(const DrawnLetter& one) {
        return fmt::format("letter at {:.0f}, {:.0f}", one.low.x, one.low.y);
    }
    void expect_whole(float scale) {
        const std::vector<DrawnLetter> all = letters_of(viewer().interface().lists());
        const std::vector<Places::View> views = places_of(state()).views;
        size_t seen = 0;
        std::map<int, std::vector<const DrawnLetter*>> rows; // by their middle, 16 pixels a row
        for (const DrawnLetter& one : all) {
            // Letters over pictures have shadows, which are letters; SmallWindow looks at them.
            const bool is_over_view =
                std::any_of(views.begin(), views.end(), [&](const auto& view) {
                    return view.box.holds({one.middle().x, one.middle().y});
                });
            if (!is_seen(one) || is_over_view)
                continue;
            ++seen;
            // A letter that ImGui cuts off itself has a part of its glyph; one that the device cuts
            // off lies beyond the clip. A pixel round a glyph is empty.
            EXPECT_FALSE(one.is_part) << at(one);
            EXPECT_GE(one.low.x, one.clip.x - 1.0f) << at(one);
            EXPECT_LE(one.high.x, one.clip.z + 1.0f) << at(one);
            rows[static_cast<int>(one.middle().y / 16.0f)].push_back(&one);
        }
        EXPECT_GE(seen, 100u);
        // Neighbours of a word may touch by their serifs: by less than a fifth of a line.
        const float touch = 0.2f * 18.0f * scale;
        for (const auto& [row, letters] : rows)
            for (const int other : {row, row + 1}) {
                if (!rows.count(other))
                    continue;
                for (const DrawnLetter* a : letters)
                    for (const DrawnLetter* b : rows.at(other))
                        if (a != b) {
                            const float x =
                                std::min(a->high.x, b->high.x) - std::max(a->low.x, b->low.x);
                            const float y =
                                std::min(a->high.y, b->high.y) - std::max(a->low.y, b->low.y);
                            EXPECT_FALSE(x > touch && y > touch) << at(*a) << ", " << at(*b);
                        }
            }
    }
};

TEST_F(InterfaceLetters, AreWholeAndApart) {
    Settings settings;
    for (const SectionEntry& section : sections())
        settings.sections.set(section.section, true);
    for (const bool light : {false, true}) {
        settings.light = light;
        set_settings(settings);
        for (const auto& [size, scale] : {std::pair(glm::uvec2(1280, 720), 1.0),
                                          {glm::uvec2(1280, 800), 1.0},
                                          {glm::uvec2(1920, 1080), 1.0},
                                          {glm::uvec2(1920, 1080), 1.5},
                                          {glm::uvec2(1920, 1080), 2.0},
                                          {glm::uvec2(3840, 2160), 1.0},
                                          {glm::uvec2(3840, 2160), 1.5},
                                          {glm::uvec2(3840, 2160), 2.0}}) {
            if (light && size.y != 1080)
                continue; // a theme moves nothing: its lengths are the same
            SCOPED_TRACE(fmt::format("{} x {} at {}", size.x, size.y, scale));
            open_window(Source{open_synthetic("synthetic:phantom?size=8")}, size, {}, {}, scale);
            note_name(1, "liver");
            note_name(2, "portal vein and splenic vein");
            for (const WindowTask task : kTasks) {
                SCOPED_TRACE(name_of(task));
                take_task(task);
                move({3.0, 3.0}); // no tooltip
                frame({}, 60.0);  // messages have been read
                frame({});
                expect_whole(static_cast<float>(scale));
            }
        }
    }
}

} // namespace
} // namespace palpate::view
