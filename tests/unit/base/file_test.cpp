#include "engine/base/file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <set>

#include "engine/base/writable.h"
#include "tests/support/kill.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

std::span<const std::byte> as_bytes(const std::string& text) {
    return std::as_bytes(std::span(text));
}

class File : public TemporaryFolder {
 protected:
    std::set<std::string> names() const {
        std::set<std::string> found;
        for (const auto& entry : fs::directory_iterator(file("")))
            found.insert(entry.path().filename().string());
        return found;
    }
};

TEST_F(File, IsWrittenWholeAndReplaced) {
    for (const std::string text : {"first", "second, longer", ""}) {
        ASSERT_TRUE(save_bytes(file("a.txt"), as_bytes(text)));
        EXPECT_EQ(bytes_of("a.txt"), text);
        EXPECT_EQ(load_text(file("a.txt")).value(), text);
    }
    EXPECT_EQ(names(), std::set<std::string>{"a.txt"});
}

TEST_F(File, TemporaryNameEndsAsTheNameDoesAndLiesBesideIt) {
    ASSERT_TRUE(write_atomically(file("scan.nii.gz"), [&](const fs::path& temporary) {
        EXPECT_EQ(temporary.parent_path(), file("scan.nii.gz").parent_path());
        EXPECT_NE(temporary, file("scan.nii.gz"));
        EXPECT_TRUE(temporary.string().ends_with("scan.nii.gz"));
        return save_bytes(temporary, as_bytes("x"));
    }));
    EXPECT_EQ(names(), std::set<std::string>{"scan.nii.gz"});
}

TEST_F(File, FailingWriterLeavesWhatWasThere) {
    const auto fails = [](const fs::path& temporary) -> Result<void> {
        PALPATE_TRY(save_bytes(temporary, as_bytes("part")));
        return fail("the scanner is on fire");
    };
    EXPECT_EQ(write_atomically(file("new"), fails).error().message, "the scanner is on fire");
    EXPECT_TRUE(names().empty());
    write("old", "kept");
    EXPECT_FALSE(write_atomically(file("old"), fails));
    EXPECT_EQ(bytes_of("old"), "kept");
    EXPECT_EQ(names(), std::set<std::string>{"old"});
}

// Whole files wait under their temporary names until all are there.
TEST_F(File, FilesTogetherAppearTogetherOrNotAtAll) {
    write("old", "kept");
    for (const bool succeeds : {false, true}) {
        FilesTogether files;
        ASSERT_TRUE(save_bytes(file("old"), as_bytes("first")));
        ASSERT_TRUE(save_bytes(file("old"), as_bytes("second"))); // written again
        ASSERT_TRUE(save_bytes(file("new"), as_bytes("beside it")));
        EXPECT_EQ(bytes_of("old"), "kept");
        EXPECT_FALSE(fs::exists(file("new")));
        EXPECT_EQ(fs::file_size(FilesTogether::written(file("new"))), 9u);
        EXPECT_EQ(FilesTogether::written(file("other")), file("other"));
        if (succeeds) {
            ASSERT_TRUE(files.commit());
        }
    }
    EXPECT_EQ(bytes_of("old"), "second");
    EXPECT_EQ(names(), (std::set<std::string>{"new", "old"}));
}

TEST_F(File, TheNewestFilesTogetherTakeWhatIsWritten) {
    {
        FilesTogether outer;
        ASSERT_TRUE(save_bytes(file("outer"), as_bytes("1")));
        {
            FilesTogether inner;
            ASSERT_TRUE(save_bytes(file("inner"), as_bytes("2")));
            ASSERT_TRUE(FilesTogether::commit_newest());
            EXPECT_EQ(names().count("inner"), 1u);
            ASSERT_TRUE(save_bytes(file("left"), as_bytes("3")));
        }
        EXPECT_EQ(names().count("outer"), 0u);
        outer.close();
        ASSERT_TRUE(save_bytes(file("later"), as_bytes("4")));
        EXPECT_EQ(names().count("later"), 1u);
        fs::create_directory(file("outer")); // its name is taken meanwhile
        const Result<void> done = outer.commit();
        ASSERT_FALSE(done);
        EXPECT_NE(done.error().message.find("outer"), std::string::npos);
    }
    EXPECT_EQ(names(), (std::set<std::string>{"inner", "later", "outer"}));
}

TEST_F(File, WriterThatWritesNothingIsAnError) {
    const Result<void> written =
        write_atomically(file("a"), [](const fs::path&) -> Result<void> { return {}; });
    ASSERT_FALSE(written);
    EXPECT_NE(written.error().message.find("No such file"), std::string::npos);
    EXPECT_TRUE(names().empty());
}

TEST_F(File, WhatIsNoFileIsLeftAlone) {
    for (const char* device : {"/dev/null", "/dev/full"}) {
        EXPECT_FALSE(save_bytes(device, as_bytes("x")));
        EXPECT_FALSE(expect_writable(device));
        EXPECT_TRUE(fs::is_character_file(device));
    }
    EXPECT_FALSE(expect_writable(file("")));
    EXPECT_FALSE(expect_writable(file("no/such")));
    EXPECT_TRUE(expect_writable(file("new")));
    EXPECT_TRUE(names().empty());
}

// The file that a link leads to is written, and the link stays; streams of the process are no
// files, whatever they lead to.
TEST_F(File, LinksStay) {
    write("real", "old");
    fs::create_symlink("real", file("link"));
    ASSERT_TRUE(save_bytes(file("link"), as_bytes("new")));
    EXPECT_TRUE(fs::is_symlink(file("link")));
    EXPECT_EQ(bytes_of("real"), "new");
    fs::create_symlink("/dev/null", file("null"));
    EXPECT_FALSE(save_bytes(file("null"), as_bytes("x")));
    fs::create_symlink("/proc/self/fd/1", file("stream"));
    EXPECT_FALSE(save_bytes(file("stream"), as_bytes("x")));
    EXPECT_TRUE(fs::is_symlink(file("stream")));
    fs::create_symlink("absent", file("dangling"));
    EXPECT_TRUE(save_bytes(file("dangling"), as_bytes("x")));
    EXPECT_EQ(bytes_of("dangling"), "x");
}

// Neither place can be written by anyone, the superuser included.
TEST_F(File, FolderThatCannotBeWrittenIsOneSentence) {
    write("plain", "a file");
    fs::create_directory(file("folder"));
    for (const fs::path& path : {file("absent/a.png"), file("plain/a.png"), file("folder"),
                                 fs::path("/proc/palpate.png")}) {
        const Result<void> written = save_bytes(path, as_bytes("x"));
        ASSERT_FALSE(written) << path;
        const std::string& message = written.error().message;
        EXPECT_TRUE(message.starts_with(path.string() + ": cannot be written: ")) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos);
    }
    EXPECT_EQ(names(), (std::set<std::string>{"folder", "plain"}));
}

// A limit on the size of files stands in for a full disk.
TEST_F(File, FullDiskIsAnErrorAndLeavesNothing) {
    const std::string large(1 << 20, 'x');
    const End end = run_and_kill(std::chrono::hours(1), [&] {
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{1 << 16, 1 << 16};
        ::setrlimit(RLIMIT_FSIZE, &limit);
        const Result<void> written = save_bytes(file("large"), as_bytes(large));
        return written ? 1 : written.error().message.find("File too large") == std::string::npos;
    });
    EXPECT_EQ(end, End::finished);
    EXPECT_TRUE(names().empty());
}

TEST_F(File, KilledWriterLeavesTheOldFileOrTheNew) {
    const std::string before(100000, 'a'), after(4 << 20, 'b');
    const auto work = [&] { return save_bytes(file("data.bin"), as_bytes(after)) ? 0 : 1; };
    int old_ones = 0, new_ones = 0;
    write("data.bin", before);
    kill_at_many_moments(40, work, [&] {
        const std::string found = bytes_of("data.bin");
        ASSERT_TRUE(found == before || found == after) << "partial: " << found.size() << " bytes";
        ++(found == before ? old_ones : new_ones);
        write("data.bin", before);
    });
    EXPECT_GT(old_ones, 0);
}

TEST_F(File, LoadTextRefusesWithBothNumbers) {
    write("long", std::string(1000, 'x'));
    EXPECT_EQ(load_text(file("long"), 999).error().message,
              file("long").string() + ": expected at most 999 bytes, found 1000");
    EXPECT_TRUE(load_text(file("long"), 1000));
    EXPECT_EQ(load_text(file("absent")).error().message,
              file("absent").string() + ": no such file");
    EXPECT_NE(load_text("/dev/zero").error().message.find("expected a file"), std::string::npos);
    EXPECT_NE(load_text(file("")).error().message.find("expected a file"), std::string::npos);
}

} // namespace
} // namespace palpate
