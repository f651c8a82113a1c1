// Folders, and what was opened last.

#include "apps/view/panels/file_browser.h"
#include "apps/view/document/free_name.h"
#include "apps/view/window/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "tests/support/temporary_folder.h"

namespace palpate::view {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Files : public TemporaryFolder {};

TEST_F(Files, FoldersComeFirstAndHiddenNamesNot) {
    write("b.nii", "12345");
    write("a.nii", "1");
    write(".hidden", "1");
    fs::create_directory(file("z"));
    fs::create_symlink(file("gone"), file("link"));
    const auto list = list_folder(file("."));
    ASSERT_TRUE(list) << list.error().message;
    const std::vector<BrowserEntry> expected{
        {"z", true, 0}, {"a.nii", false, 1}, {"b.nii", false, 5}, {"link", false, 0}};
    EXPECT_EQ(*list, expected);
    const auto none = list_folder(file("none"));
    ASSERT_FALSE(none);
    EXPECT_THAT(none.error().message, HasSubstr("none: cannot be read"));
}

TEST_F(Files, AFreeNameIsNumberedBeforeItsWholeEnding) {
    EXPECT_EQ(free_name(file("labels.nii.gz")), file("labels.nii.gz"));
    for (const char* name :
         {"labels.nii.gz", "labels-1.nii.gz", "a.b.csv", "p.palpate", "bare", "m.raw"})
        write(name, "1");
    EXPECT_EQ(free_name(file("labels.nii.gz")), file("labels-2.nii.gz"));
    EXPECT_EQ(free_name(file("a.b.csv")), file("a.b-1.csv"));
    EXPECT_EQ(free_name(file("p.palpate")), file("p-1.palpate"));
    EXPECT_EQ(free_name(file("bare")), file("bare-1"));
    EXPECT_EQ(free_name(file("m.mhd")), file("m-1.mhd")) << "its voxels would replace m.raw";
    EXPECT_EQ(free_name(file("m.mha")), file("m.mha"));
    EXPECT_EQ(free_name(file("new.png"), 1), file("new-1.png"));
    fs::create_symlink(file("gone"), file("link.csv"));
    EXPECT_EQ(free_name(file("link.csv")), file("link-1.csv"));
}

TEST_F(Files, TheNewestIsFirstAndListedOnce) {
    const fs::path list = file("deep/er/recent.json");
    EXPECT_TRUE(load_recent(list).empty());
    for (int i = 0; i < 20; ++i)
        ASSERT_TRUE(add_recent(list, "f" + std::to_string(i)));
    ASSERT_TRUE(add_recent(list, "f15"));
    const auto recent = load_recent(list);
    ASSERT_EQ(recent.size(), kMostRecent);
    EXPECT_EQ(recent[0], "f15");
    EXPECT_EQ(recent[1], "f19");
    EXPECT_EQ(std::count(recent.begin(), recent.end(), "f15"), 1);
}

TEST_F(Files, OnePathIsListedOnceHoweverItWasTyped) {
    using ::testing::ElementsAre;
    const fs::path list = file("recent.json");
    write("recent.json", R"(["/x/./ct.nii", "/x/p.palpate/", "/x/ct.nii", "/"])"); // older program
    EXPECT_THAT(load_recent(list), ElementsAre("/x/ct.nii", "/x/p.palpate", "/"));
    ASSERT_TRUE(add_recent(list, "/x/y/../p.palpate"));
    ASSERT_TRUE(add_recent(list, "/x/./mr/"));
    EXPECT_THAT(load_recent(list), ElementsAre("/x/mr", "/x/p.palpate", "/x/ct.nii", "/"));
}

TEST_F(Files, ADamagedListIsNoneAndAnUnwritableOneAnError) {
    for (const char* text : {"", "{", "{\"a\": 1}", "[1, 2]", "\"x\""}) {
        write("recent.json", text);
        EXPECT_TRUE(load_recent(file("recent.json")).empty()) << text;
    }
    write("plain", "");
    EXPECT_FALSE(add_recent(file("plain/recent.json"), "a")); // its folder is a file
    EXPECT_TRUE(add_recent({}, "a"));                         // no home
}

TEST_F(Files, TheListLiesWhereTheXdgSpecificationSays) {
    ::setenv("XDG_STATE_HOME", "/state", 1);
    EXPECT_EQ(recent_file(), "/state/palpate/recent.json");
    ::setenv("XDG_STATE_HOME", "relative", 1); // to be ignored
    ::setenv("HOME", "/home/a", 1);
    EXPECT_EQ(recent_file(), "/home/a/.local/state/palpate/recent.json");
    ::unsetenv("XDG_STATE_HOME");
    ::unsetenv("HOME");
    EXPECT_EQ(recent_file(), "");
}

TEST_F(Files, SettingsAreKeptAndADamagedFileIsTheDefaults) {
    const fs::path path = file("deep/view.json");
    EXPECT_EQ(load_settings(path), Settings());
    const Settings liked{true, 1.5};
    ASSERT_TRUE(save_settings(path, liked));
    EXPECT_EQ(load_settings(path), liked);
    for (const char* text : {"", "{", "[]", R"({"light": 3, "text_scale": 1e9})"}) {
        write("view.json", text);
        EXPECT_EQ(load_settings(file("view.json")), Settings()) << text;
    }
    EXPECT_FALSE(save_settings(file("view.json/x"), liked)); // its folder is a file
    EXPECT_TRUE(save_settings({}, liked));                   // no home
}

} // namespace
} // namespace palpate::view
