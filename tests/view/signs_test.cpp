// Signs that work is under way, and rows that stay where the pointer is.

#include <algorithm>

#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

class Signs : public ViewerTest {
 protected:
    bool is_said_in_3d(const std::string& words) {
        const auto& texts = viewer().interface().texts();
        return std::ranges::any_of(texts, [&](const ViewText& one) {
            return one.panel == Panel::volume && one.text.starts_with(words);
        });
    }
    int top_of(const std::string& id) { return viewer().interface().widgets().at(id).low_px.y; }
};

// Without a thread a picture comes when it is asked for: until then the one before is seen.
TEST_F(Signs, APictureOfOtherRaysThatTakesLongSaysSo) {
    open("synthetic:phantom?size=24");
    ASSERT_TRUE(viewer().shot());
    frame({});
    EXPECT_FALSE(is_said_in_3d("drawing"));
    key("v"); // by the surface
    frame({}, 3.0);
    frame({});
    EXPECT_TRUE(is_said_in_3d("drawing .."));
    ASSERT_TRUE(viewer().shot());
    EXPECT_FALSE(is_said_in_3d("drawing"));
}

TEST_F(Signs, ACameraThatMovesIsNoOtherPicture) {
    open("synthetic:phantom?size=24");
    ASSERT_TRUE(viewer().shot());
    key("home");
    frame({}, 3.0);
    frame({});
    EXPECT_FALSE(is_said_in_3d("drawing"));
}

TEST_F(Signs, RowsOfAnExportStayWhereTheyAre) {
    open("synthetic:phantom?size=24", {1000, 1200});
    show("print");
    const int before = top_of("export/decimate");
    click_widget("export/largest");
    frame({});
    EXPECT_TRUE(state().exporting.made.pieces.largest_only);
    EXPECT_EQ(top_of("export/decimate"), before);
    show("figure");
    const int paper = top_of("figure/paper");
    click_widget("figure/panel");
    frame({});
    click_widget("figure/panel/axial");
    frame({});
    EXPECT_EQ(state().figure.panel, Panel::axial);
    EXPECT_EQ(top_of("figure/paper"), paper);
}

// A file that is opened moves to the top of the recent files once the pointer has left them.
TEST_F(Signs, ASecondClickOpensNoOtherFile) {
    std::vector<std::string> recent{"synthetic:ball?size=24", "synthetic:phantom?size=20",
                                    "synthetic:phantom?size=24"};
    set_options([&](ViewerOptions& options) {
        options.recent = [&](const std::string& path) {
            if (!path.empty()) {
                std::erase(recent, path);
                recent.insert(recent.begin(), path);
            }
            return recent;
        };
    });
    open("synthetic:phantom?size=24");
    show("files");
    click_widget("file/recent/1");
    frame({});
    ASSERT_EQ(viewer().work().path(), "synthetic:phantom?size=20");
    button(true);
    button(false);
    frame({});
    EXPECT_EQ(viewer().work().path(), "synthetic:phantom?size=20");
    move(middle(Panel::axial));
    frame({});
    frame({});
    click_widget("file/recent/1"); // the one that was first before
    frame({});
    EXPECT_EQ(viewer().work().path(), "synthetic:ball?size=24");
}

} // namespace
} // namespace palpate::view
