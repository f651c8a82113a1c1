// Folders, and what was opened last.

#include "apps/view/panels/file_browser.h"
#include "apps/view/document/free_name.h"
#include "apps/view/panels/series_previews.h"
#include "apps/view/window/settings.h"
#include "apps/view/window/small_pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/stat.h>

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
    std::vector<BrowserEntry> dateless = *list;
    for (BrowserEntry& entry : dateless)
        entry.modified_s = 0;
    EXPECT_EQ(dateless, expected);
    const auto none = list_folder(file("none"));
    ASSERT_FALSE(none);
    EXPECT_THAT(none.error().message, HasSubstr("none: cannot be read"));
}

TEST_F(Files, NumbersInNamesAreSortedByTheirValues) {
    std::vector<BrowserEntry> entries;
    const std::vector<std::string> sorted{"1",   "2",       "10", "a1.nii", "a02.nii", "a2b",
                                          "a10", "a10.nii", "b",  "b1-2",   "b1-10"};
    for (const std::string& name : sorted)
        entries.insert(entries.begin(), {name, false, 7});
    for (const EntryOrder order : {EntryOrder::name, EntryOrder::size, EntryOrder::date}) {
        sort_entries(entries, order, false);
        for (size_t i = 0; i < sorted.size(); ++i)
            EXPECT_EQ(entries[i].name, sorted[i]);
    }
}

TEST_F(Files, EntriesHaveTheirDates) {
    write("old.nii", "1");
    write("new.nii", "1");
    const timespec old_s[] = {{1000000000, 0}, {1000000000, 0}}; // 2001-09-09
    ASSERT_EQ(::utimensat(AT_FDCWD, file("old.nii").c_str(), old_s, 0), 0);
    const auto list = list_folder(file("."));
    ASSERT_TRUE(list) << list.error().message;
    EXPECT_EQ((*list)[1].name, "old.nii");
    EXPECT_EQ((*list)[1].modified_s, 1000000000);
    struct stat now {};
    ASSERT_EQ(::stat(file("new.nii").c_str(), &now), 0);
    EXPECT_EQ((*list)[0].modified_s, now.st_mtime);
}

TEST(EntryOrders, FoldersStayFirst) {
    const std::vector<BrowserEntry> all{{"b", true, 0, 5},
                                        {"a", true, 0, 9},
                                        {"y", false, 7, 3},
                                        {"x", false, 7, 1},
                                        {"z", false, 2, 2}};
    const auto names = [&](EntryOrder order, bool falls) {
        std::vector<BrowserEntry> sorted = all;
        sort_entries(sorted, order, falls);
        std::string text;
        for (const BrowserEntry& entry : sorted)
            text += entry.name;
        return text;
    };
    EXPECT_EQ(names(EntryOrder::name, false), "abxyz");
    EXPECT_EQ(names(EntryOrder::name, true), "bazyx");
    EXPECT_EQ(names(EntryOrder::size, true), "bayxz");
    EXPECT_EQ(names(EntryOrder::date, true), "abyzx");
    EXPECT_EQ(names(EntryOrder::date, false), "baxzy");
}

TEST(ListedEntries, HoldAPartOfAName) {
    const std::vector<BrowserEntry> all{{"CT", true},  {"head_ct.nii.gz"}, {"notes.txt"},
                                        {"IM0001"},    {"ct.001"},         {"1.2.840.113"},
                                        {"Scan.NRRD"}, {"ct.pdf"},         {"thesis.doc"},
                                        {"ct_1.png"},  {"ct_2.PNG"}};
    using ::testing::ElementsAre;
    EXPECT_THAT(listed_entries(all, "", false), ElementsAre(0, 1, 3, 4, 5, 6));
    EXPECT_THAT(listed_entries(all, "", true), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10));
    EXPECT_THAT(listed_entries(all, "ct", false), ElementsAre(0, 1, 4));
    EXPECT_THAT(listed_entries(all, "CT", true), ElementsAre(0, 1, 4, 7, 9, 10));
    EXPECT_TRUE(listed_entries(all, "quux", true).empty());
    EXPECT_EQ(count_pictures(all), 2u);
}

TEST_F(Files, PlacesAreThoseThatAreThereOnce) {
    fs::create_directories(file("home/scans"));
    fs::create_directories(file("media/not_mounted"));
    const std::vector<std::string> recent{file("home/scans/a.nii"), file("home/scans/b.nii"),
                                          file("gone/c.nii"), "synthetic:ball"};
    const std::vector<BrowserPlace> expected{{"home", file("home")}, {"scans", file("home/scans")}};
    EXPECT_EQ(browser_places(file("home"), recent, {file("media"), file("none")}), expected);
    EXPECT_TRUE(browser_places("", {}, {}).empty());
    // A file system that is mounted: /proc, everywhere that these tests run.
    const auto disks = browser_places("", {}, {"/"});
    EXPECT_EQ(std::count(disks.begin(), disks.end(), BrowserPlace{"proc", "/proc"}), 1);
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
    Settings liked{true, 1.5, 311.0};
    liked.indices = liked.hints_seen = true;
    liked.sections.set(Section::clips, true);
    liked.sections.set(Section::window, false);
    ASSERT_TRUE(save_settings(path, liked));
    EXPECT_EQ(load_settings(path), liked);
    for (const char* text : {"", "{", "[]", R"({"light": 3, "text_scale": 1e9, "panel_px": 3})"}) {
        write("view.json", text);
        EXPECT_EQ(load_settings(file("view.json")), Settings()) << text;
    }
    EXPECT_FALSE(save_settings(file("view.json/x"), liked)); // its folder is a file
    EXPECT_TRUE(save_settings({}, liked));                   // no home
}

TEST(FileNames, AProposedNameFollowsAndATypedOneStays) {
    EXPECT_EQ(followed_name("", "", "bone.stl"), "bone.stl");
    EXPECT_EQ(followed_name("bone.stl", "bone.stl", "skin.stl"), "skin.stl");
    EXPECT_EQ(followed_name("/a/b/bone.stl", "bone.stl", "skin.stl"), "/a/b/skin.stl");
    EXPECT_EQ(followed_name("bone.ply", "bone.stl", "skin.stl"), "bone.ply");
    EXPECT_EQ(file_word("left kidney/2-\u00e9"), "left_kidney_2-\u00e9");
}

// Bytes come back as they were; names of files are in no name of a picture.
TEST_F(Files, SmallPicturesAreKeptForListedFiles) {
    std::vector<std::byte> rgba;
    for (uint32_t i = 0; i < SeriesPreviews::kSide_px * SeriesPreviews::kSide_px; ++i)
        rgba.insert(rgba.end(), {std::byte(i % 251), std::byte(i % 13), std::byte(i / 97 % 256),
                                 std::byte{255}});
    const fs::path folder = file("deep/pictures");
    EXPECT_FALSE(load_small_picture(folder, "/home/a/doe.nii"));
    ASSERT_TRUE(keep_small_picture(folder, "/home/a/doe.nii", rgba));
    ASSERT_TRUE(keep_small_picture(folder, "/home/a/roe.nii", rgba));
    EXPECT_EQ(load_small_picture(folder, "/home/a/doe.nii").value(), rgba);
    for (const auto& entry : fs::directory_iterator(folder))
        EXPECT_EQ(entry.path().string().find("oe"), std::string::npos) << entry.path();
    forget_small_pictures(folder, {"/home/a/roe.nii"});
    EXPECT_FALSE(load_small_picture(folder, "/home/a/doe.nii"));
    EXPECT_TRUE(load_small_picture(folder, "/home/a/roe.nii"));
    EXPECT_TRUE(keep_small_picture({}, "/home/a/doe.nii", rgba)); // no home
}

} // namespace
} // namespace palpate::view
