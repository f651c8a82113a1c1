// The chooser of files in the window.

#include <filesystem>
#include <fstream>

#include "engine/volume/builder.h"
#include "tests/support/temporary_folder.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

namespace fs = std::filesystem;

// In a folder of its own, which has a/inner.nii, ct_head.nii.gz, mr.nii and notes.txt.
class BrowserTest : public ViewerTest {
 protected:
    void SetUp() override {
        ViewerTest::SetUp();
        before_ = fs::current_path();
        folder_ = fs::path(::testing::TempDir()) / "palpate_browser";
        fs::remove_all(folder_);
        fs::create_directories(folder_ / "a");
        for (const char* name : {"a/inner.nii", "ct_head.nii.gz", "mr.nii", "notes.txt"})
            std::ofstream(folder_ / name) << "12345";
        fs::current_path(folder_);
        set_beside([this](const std::string& path, bool) -> Result<LoadedVolume> {
            asked_for_ = path;
            return fail("{}: not read here", path);
        });
        open("synthetic:phantom?size=24", {1000, 700});
    }
    void TearDown() override {
        ViewerTest::TearDown();
        fs::current_path(before_);
        fs::remove_all(folder_);
    }
    void browse_for_labels() {
        show("labels");
        click_widget("labels/open");
        frame({});
    }
    void type(const std::string& text) {
        frame({{.kind = Event::Kind::text, .text = text}});
        frame({});
    }
    void press(const std::string& id) {
        ASSERT_TRUE(has(id)) << id;
        const Box box = viewer().interface().widgets().at(id);
        click(glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px));
        frame({});
    }
    bool has(const std::string& id) { return viewer().interface().widgets().count(id) > 0; }
    const fs::path& folder() { return folder_; }
    const std::string& asked_for() { return asked_for_; }

 private:
    fs::path before_, folder_;
    std::string asked_for_;
};

TEST_F(BrowserTest, AClickOpens) {
    browse_for_labels();
    press("browser/a");
    press("browser/inner.nii");
    EXPECT_EQ(asked_for(), (folder() / "a/inner.nii").string());
    EXPECT_FALSE(state().browser_open);
}

// The second click of a double click meets the first row of the folder that the first one entered.
TEST_F(BrowserTest, ADoubleClickEntersOneFolder) {
    fs::create_directories(folder() / "a/aa/aaa");
    browse_for_labels();
    const Box box = viewer().interface().widgets().at("browser/a");
    const glm::dvec2 at = glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px);
    move(at);
    for (const bool down : {true, false, true, false})
        frame({{.kind = Event::Kind::button, .button = Button::left, .down = down}}, 0.05);
    frame({});
    EXPECT_TRUE(has("browser/aa")) << "the folder is shown, and not the one in it";
    EXPECT_FALSE(has("browser/aaa"));
    press("browser/aa"); // a second later: a click of its own
    EXPECT_TRUE(has("browser/aaa"));
}

TEST_F(BrowserTest, APartOfANameIsEnough) {
    browse_for_labels();
    EXPECT_TRUE(has("browser/mr.nii"));
    type("HEAD");
    EXPECT_TRUE(has("browser/ct_head.nii.gz"));
    EXPECT_FALSE(has("browser/mr.nii"));
    EXPECT_FALSE(has("browser/a"));
    key("enter");
    frame({});
    EXPECT_EQ(asked_for(), (folder() / "ct_head.nii.gz").string());
}

TEST_F(BrowserTest, ANameIsOneInTheFolderThatIsShown) {
    browse_for_labels();
    press("browser/a");
    press("browser/path");
    type("inner.nii");
    key("enter");
    frame({});
    EXPECT_EQ(asked_for(), (folder() / "a/inner.nii").string());
}

TEST_F(BrowserTest, OtherFilesAreListedWhenAllAreWanted) {
    browse_for_labels();
    EXPECT_FALSE(has("browser/notes.txt"));
    press("browser/all");
    EXPECT_TRUE(has("browser/notes.txt"));
}

// After a moment, and of one file: the one that is pointed at.
TEST_F(BrowserTest, AFileThatIsPointedAtHasItsPicture) {
    set_beside([](const std::string& path, bool) -> Result<LoadedVolume> {
        if (!path.ends_with("mr.nii"))
            return fail("{}: not read here", path);
        return LoadedVolume{make_volume(make_grid({4, 4, 4}, {1, 1, 1}), ScalarType::u8,
                                        [](glm::uvec3 at) { return 60.0 * at.x; }),
                            {},
                            {},
                            "MR",
                            {},
                            {}};
    });
    open("synthetic:phantom?size=24", {1000, 700});
    browse_for_labels();
    const auto point_at = [&](const std::string& name) {
        const Box box = viewer().interface().widgets().at("browser/" + name);
        move(glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px));
        for (int i = 0; i < 4; ++i)
            frame({});
    };
    EXPECT_FALSE(has("browser/preview"));
    point_at("mr.nii");
    EXPECT_TRUE(has("browser/preview"));
    point_at("ct_head.nii.gz"); // cannot be read
    EXPECT_FALSE(has("browser/preview"));
    key("escape");
    frame({});
    EXPECT_FALSE(state().browser_open);
}

TEST_F(BrowserTest, AnEmptyFolderSaysSo) {
    fs::create_directories(folder() / "empty");
    browse_for_labels();
    EXPECT_FALSE(has("browser/none"));
    press("browser/empty");
    EXPECT_TRUE(has("browser/none"));
}

// The dialog begins in the folder of the file that was opened last, and offers that and the ones
// before it.
TEST_F(BrowserTest, WhatWasOpenedLastIsNear) {
    set_options([this](ViewerOptions& options) {
        options.recent = [this](const std::string&) {
            return std::vector<std::string>{(folder() / "a/inner.nii").string(),
                                            (folder() / "mr.nii").string()};
        };
    });
    open("synthetic:phantom?size=24", {1000, 700});
    browse_for_labels();
    EXPECT_TRUE(has("browser/inner.nii"));
    EXPECT_FALSE(has("browser/mr.nii"));
    press("browser/recent/1");
    EXPECT_EQ(asked_for(), (folder() / "mr.nii").string());
}

TEST_F(BrowserTest, UpAndAPlaceChangeTheFolder) {
    browse_for_labels();
    press("browser/a");
    EXPECT_TRUE(has("browser/inner.nii"));
    press("browser/up");
    EXPECT_TRUE(has("browser/mr.nii"));
}

TEST_F(BrowserTest, OneEscapeClosesIt) {
    browse_for_labels();
    type("mr");
    key("escape");
    EXPECT_FALSE(state().browser_open);
    EXPECT_TRUE(asked_for().empty());
}

TEST_F(BrowserTest, ANameOfAnExportIsChosen) {
    show("label_files");
    click_widget("labels/file/choose");
    frame({});
    ASSERT_TRUE(state().browser_open);
    press("browser/a");
    press("browser/folder"); // here
    EXPECT_FALSE(state().browser_open);
    frame({});
    // The field has it: it is where the list begins next time.
    click_widget("labels/file/choose");
    frame({});
    EXPECT_TRUE(has("browser/inner.nii"));
    EXPECT_FALSE(has("browser/mr.nii"));
}

} // namespace
} // namespace palpate::view
