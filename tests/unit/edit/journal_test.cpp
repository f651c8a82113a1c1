#include "engine/edit/journal.h"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <zlib.h>

#include <algorithm>
#include <csignal>

#include "tests/support/temporary_folder.h"
#include "tests/unit/edit/twin.h"

namespace palpate {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class JournalTest : public TemporaryFolder {
 protected:
    static std::vector<JournalEntry> entries(int count) {
        Random random(1);
        std::vector<JournalEntry> all;
        const Grid grid = make_grid(glm::uvec3(30), glm::dvec3(1));
        for (int i = 0; i < count; ++i) {
            if (i % 4 == 3) {
                all.push_back(
                    {i % 8 == 3 ? JournalEntry::Kind::undo : JournalEntry::Kind::redo, {}});
                continue;
            }
            all.push_back({JournalEntry::Kind::stroke,
                           *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 2})", ""),
                                        random_operation(random, OperationKind::erode),
                                        random_path(random, grid, 5))});
        }
        return all;
    }
    static std::vector<std::string> texts(const std::vector<JournalEntry>& all) {
        std::vector<std::string> out;
        for (const JournalEntry& entry : all)
            out.push_back(entry.text());
        return out;
    }
    const Volume volume_ = make_volume(make_grid(glm::uvec3(30), {1, 2, 3}, {0.1, 0.2, 0.3}),
                                       ScalarType::u8, [](glm::uvec3 i) { return i.x % 3; });
    const Journal::Base base_ = Journal::base_of(volume_);
};

TEST_F(JournalTest, HoldsWhatWasAppended) {
    const auto all = entries(9);
    {
        Result<Journal> journal = Journal::create(file("j"), base_);
        ASSERT_TRUE(journal) << journal.error().message;
        for (int i = 0; i < 5; ++i)
            ASSERT_TRUE(journal->append(all[size_t(i)]));
    }
    {
        Result<Journal::Found> found = Journal::open(file("j"), base_);
        ASSERT_TRUE(found) << found.error().message;
        EXPECT_EQ(found->entries.size(), 5u);
        for (int i = 5; i < 9; ++i)
            ASSERT_TRUE(found->journal.append(all[size_t(i)]));
    }
    EXPECT_EQ(texts(Journal::peek(file("j"))->entries), texts(all));
    Result<Journal::Found> found = Journal::open(file("j"), base_);
    EXPECT_FALSE(found->cut);
    EXPECT_EQ(texts(found->entries), texts(all));
    found->journal.remove();
    EXPECT_FALSE(std::filesystem::exists(file("j")));
}

// Cut anywhere, or zeros from there on as after a loss of power: what was whole is there, in order,
// and the journal can be gone on with.
TEST_F(JournalTest, EveryTruncationEndsAtAWholeEntry) {
    const auto all = entries(4);
    std::vector<size_t> ends; // of each entry
    {
        Result<Journal> journal = Journal::create(file("j"), base_);
        ends.push_back(bytes_of("j").size());
        for (const JournalEntry& entry : all) {
            ASSERT_TRUE(journal->append(entry));
            ends.push_back(bytes_of("j").size());
        }
    }
    const std::string whole = bytes_of("j");
    for (size_t size = 0; size <= whole.size(); ++size)
        for (const size_t zeros : {0, 1, 7, 8, 9, 4096}) {
            if (zeros > 0 && size % 16 != 0 &&
                std::find(ends.begin(), ends.end(), size) == ends.end())
                continue;
            write("cut", whole.substr(0, size) + std::string(zeros, '\0'));
            size_t expected = 0;
            while (expected < all.size() && ends[expected + 1] <= size)
                ++expected;
            Result<Journal::Found> found = Journal::open(file("cut"), base_);
            ASSERT_TRUE(found) << size << " and " << zeros << ": " << found.error().message;
            ASSERT_EQ(found->entries.size(), expected) << size << " and " << zeros;
            ASSERT_EQ(Journal::peek(file("cut"))->entries.size(), expected);
            EXPECT_EQ(found->cut,
                      zeros > 0 || std::find(ends.begin(), ends.end(), size) == ends.end());
            if (size % 64 == 0) { // each waits for the disk
                ASSERT_TRUE(found->journal.append(all[0]));
                ASSERT_EQ(Journal::peek(file("cut"))->entries.size(), expected + 1);
            }
        }
}

// Every byte behind the first entry in turn: what is before it is there, the damage is named, what
// is behind it is counted, and nothing of the file is lost.
TEST_F(JournalTest, AFlippedBitIsNamedAndLosesNothing) {
    const auto all = entries(4);
    std::vector<size_t> ends;
    {
        Result<Journal> journal = Journal::create(file("j"), base_);
        ends.push_back(bytes_of("j").size());
        for (const JournalEntry& entry : all) {
            ASSERT_TRUE(journal->append(entry));
            ends.push_back(bytes_of("j").size());
        }
    }
    const std::string whole = bytes_of("j");
    for (size_t i = ends[0]; i < whole.size(); i += 3) {
        std::string damaged = whole;
        damaged[i] = static_cast<char>(damaged[i] ^ 4);
        write("bad", damaged);
        const size_t before = size_t(std::upper_bound(ends.begin(), ends.end(), i) - ends.begin());
        Result<Journal::Found> found = Journal::open(file("bad"), base_);
        ASSERT_TRUE(found) << i << ": " << found.error().message;
        ASSERT_EQ(texts(found->entries), texts({all.begin(), all.begin() + ptrdiff_t(before - 1)}));
        EXPECT_FALSE(found->cut);
        ASSERT_TRUE(found->damage) << i;
        EXPECT_EQ(found->damage->at_byte, ends[before - 1]);
        EXPECT_EQ(found->damage->later, all.size() - before);
        EXPECT_THAT(found->damage->what,
                    HasSubstr(i < ends[before - 1] + 4 ? "found" : "checksum"));
        ASSERT_EQ(found->damage->kept_as.filename(), "bad.damaged");
        EXPECT_EQ(bytes_of("bad.damaged"), damaged);
        if (i % 64 == 0) { // each waits for the disk
            ASSERT_TRUE(found->journal.append(all[0]));
            const auto gone_on = Journal::peek(file("bad"));
            EXPECT_EQ(gone_on->entries.size(), before);
            EXPECT_FALSE(gone_on->damage);
        }
        std::filesystem::remove(file("bad.damaged"));
    }
}

// Zeros over any part, as a disk that loses a block leaves them: over the first line, over the
// first entry, over steps and over the end. Nothing is lost without a word: either the file stays
// as it is and is refused, or what is before the zeros is there and the whole is kept beside it.
TEST_F(JournalTest, ZerosOverAnyPartAreTold) {
    const auto all = entries(24);
    std::vector<size_t> ends;
    {
        Result<Journal> journal = Journal::create(file("j"), base_);
        ends.push_back(bytes_of("j").size());
        for (const JournalEntry& entry : all) {
            ASSERT_TRUE(journal->append(entry));
            ends.push_back(bytes_of("j").size());
        }
    }
    const std::string whole = bytes_of("j");
    ASSERT_GT(whole.size(), 6000u);
    Random random(3);
    for (int i = 0; i < 150; ++i) {
        size_t from = size_t(pick(random, 0, int(whole.size()) - 9));
        size_t count = size_t(pick(random, 8, 40));
        if (i % 4 == 0) // whole blocks
            from = from / 512 * 512, count = 512 * size_t(pick(random, 1, 8));
        else if (i % 4 == 1) // of the first line and the first entry
            from = size_t(pick(random, 0, int(ends[0]) - 8));
        else if (i % 4 == 2 && i % 8 == 2) // all from there on
            count = whole.size();
        const size_t to = std::min(from + count, whole.size());
        SCOPED_TRACE(fmt::format("zeros over {} .. {} of {}", from, to, whole.size()));
        std::string damaged = whole;
        std::fill(damaged.begin() + ptrdiff_t(from), damaged.begin() + ptrdiff_t(to), '\0');
        write("bad", damaged);
        size_t before = 0, later = 0; // steps
        for (size_t k = 1; k < ends.size(); ++k) {
            before += ends[k] <= from;
            later += ends[k - 1] >= to;
        }
        const bool to_the_end = to == whole.size();
        const Result<Journal::Contents> seen = Journal::peek(file("bad"));
        const Result<Journal::Found> found = Journal::open(file("bad"), base_);
        if (from < ends[0] && !to_the_end) {
            for (const std::string& why :
                 {seen ? "" : seen.error().message, found ? "" : found.error().message}) {
                EXPECT_THAT(why, AllOf(HasSubstr("damaged at byte"), HasSubstr("stays as it is")));
                EXPECT_THAT(why, HasSubstr(fmt::format("with {} step", later)));
            }
            EXPECT_EQ(bytes_of("bad"), damaged);
            continue;
        }
        ASSERT_TRUE(seen && found);
        ASSERT_EQ(texts(found->entries), texts({all.begin(), all.begin() + ptrdiff_t(before)}));
        EXPECT_EQ(seen->entries.size(), before);
        const bool is_much = whole.size() - from >= 512; // else a write that never ended
        EXPECT_EQ(found->cut, to_the_end);
        if (to_the_end && !is_much)
            continue;
        ASSERT_TRUE(seen->damage && found->damage);
        EXPECT_EQ(found->damage->later, later);
        EXPECT_EQ(bytes_of(found->damage->kept_as.filename()), damaged);
        std::filesystem::remove(found->damage->kept_as);
    }
}

TEST_F(JournalTest, FilesThatBeginInAnotherWayStay) {
    {
        Result<Journal> journal = Journal::create(file("j"), base_);
        ASSERT_TRUE(journal->append(entries(1)[0]));
    }
    const std::string whole = bytes_of("j"), rest = whole.substr(18);
    for (const auto& [bytes, why] :
         {std::pair(std::string("palpate journal 3\n") + rest, "of version 2, found 3"),
          {std::string("palpate journal 12\n") + rest, "of version 2, found 12"},
          {std::string("Palpate journal 2\n") + rest, "something else; it stays as it is, with 1"},
          {std::string(18, '\0') + rest, "18 bytes of zeros; it stays as it is, with 1 step that"},
          {rest, "something else; it stays as it is, with 1 step"},
          {std::string("a letter, and no journal at all"), "found something else"}}) {
        write("other", bytes);
        EXPECT_THAT(Journal::open(file("other"), base_).error().message, HasSubstr(why));
        EXPECT_THAT(Journal::peek(file("other")).error().message, HasSubstr(why));
        EXPECT_EQ(bytes_of("other"), bytes);
    }
}

// Several at once: all of them or, where the disk is full, none.
TEST_F(JournalTest, SeveralEntriesAreKeptTogether) {
    const auto all = entries(5);
    Result<Journal> journal = Journal::create(file("j"), base_);
    ASSERT_TRUE(journal->append(all[0]));
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit old{};
    ::getrlimit(RLIMIT_FSIZE, &old);
    const size_t room = all[1].text().size() + all[2].text().size() + 20; // of two more
    const rlimit little{bytes_of("j").size() + room, old.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &little);
    EXPECT_FALSE(journal->append(std::span(all).subspan(1)));
    ::setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_EQ(Journal::peek(file("j"))->entries.size(), 1u);
    ASSERT_TRUE(journal->append(std::span(all).subspan(1)));
    EXPECT_EQ(texts(Journal::peek(file("j"))->entries), texts(all));
}

TEST_F(JournalTest, TellsBothChecksumsAndKeepsEveryCopy) {
    const auto all = entries(3);
    size_t first = 0;
    {
        Result<Journal> journal = Journal::create(file("j"), base_);
        first = bytes_of("j").size();
        for (const JournalEntry& entry : all)
            ASSERT_TRUE(journal->append(entry));
    }
    std::string damaged = bytes_of("j");
    damaged[first + 20] ^= 1;
    const std::string payload = damaged.substr(first + 8, all[0].text().size());
    const auto crc = [](const std::string& bytes) {
        return ::crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), uInt(bytes.size()));
    };
    write("j", damaged);
    const std::string what =
        fmt::format("expected checksum {:08x}, found {:08x}", crc(all[0].text()), crc(payload));
    EXPECT_EQ(Journal::peek(file("j"))->damage->what, what);
    EXPECT_EQ(bytes_of("j"), damaged); // a look changes nothing
    write("j.damaged", "of another day");
    for (int again = 0; again < 2; ++again) { // as one that was killed before it went on
        write("j", damaged);
        const auto found = Journal::open(file("j"), base_);
        EXPECT_EQ(found->damage->what, what);
        EXPECT_EQ(found->damage->kept_as, file("j.damaged-2"));
    }
    EXPECT_EQ(bytes_of("j.damaged"), "of another day");
    EXPECT_EQ(bytes_of("j.damaged-2"), damaged);
}

// Nothing could be done with it, so it stays.
TEST_F(JournalTest, ADamagedFirstEntryIsRefused) {
    {
        Result<Journal> journal = Journal::create(file("j"), base_);
        for (const JournalEntry& entry : entries(3))
            ASSERT_TRUE(journal->append(entry));
    }
    std::string damaged = bytes_of("j");
    damaged[40] ^= 1;
    write("j", damaged);
    for (const std::string& why : {Journal::open(file("j"), base_).error().message,
                                   Journal::peek(file("j")).error().message}) {
        EXPECT_THAT(why, HasSubstr("damaged at byte 18, where it says which volume"));
        EXPECT_THAT(why, HasSubstr("with 3 steps that could be read"));
    }
    EXPECT_EQ(bytes_of("j"), damaged);
}

TEST_F(JournalTest, BelongsToWhoHasItOpen) {
    const auto all = entries(2);
    {
        Result<Journal> journal = Journal::create(file("j"), base_);
        for (const Result<void>& other :
             {Journal::expect_ended(file("j")), Journal::discard(file("j"))})
            EXPECT_EQ(other ? "" : other.error().message,
                      file("j").string() +
                          ": expected the journal of an edit that has ended, found one that is "
                          "running");
        EXPECT_THAT(Journal::open(file("j"), base_).error().message, HasSubstr("is running"));
        EXPECT_TRUE(Journal::is_running(file("j")));
        ASSERT_TRUE(journal->append(all[0])); // as if nobody had asked
        EXPECT_EQ(Journal::peek(file("j"))->entries.size(), 1u);
        const Journal moved = std::move(*journal);
        EXPECT_FALSE(Journal::expect_ended(file("j")));
    }
    ASSERT_TRUE(Journal::expect_ended(file("j")));
    EXPECT_FALSE(Journal::is_running(file("j")));
    EXPECT_FALSE(Journal::is_running(file("none")));
    {
        const auto found = Journal::open(file("j"), base_);
        EXPECT_EQ(found->entries.size(), 1u);
        EXPECT_FALSE(Journal::discard(file("j")));
    }
    EXPECT_TRUE(Journal::discard(file("j")));
    EXPECT_FALSE(std::filesystem::exists(file("j")));
}

TEST_F(JournalTest, BelongsToItsVolumes) {
    const auto belongs = [&](const char* name, const Document& document) {
        const auto found = Journal::open(file(name), Journal::base_of(document));
        return found ? "" : found.error().message;
    };
    ASSERT_TRUE(Journal::create(file("j"), base_));
    EXPECT_THAT(Journal::create(file("j"), base_).error().message, HasSubstr("cannot be made"));
    const Volume other =
        make_volume(volume_.grid(), ScalarType::u8, [](glm::uvec3 i) { return i.y % 3; });
    const auto with_guide = [&](const Volume& guide) {
        return with_volume(volume_, {"guide", VolumeKind::grey, guide});
    };
    EXPECT_THAT(belongs("j", other), AllOf(HasSubstr("the samples of 'volume' differ"),
                                           Not(HasSubstr("guide")), Not(HasSubstr("elsewhere"))));
    EXPECT_THAT(
        belongs("j", with_guide(other)),
        AllOf(HasSubstr("begun without a 'guide', and one is given"), Not(HasSubstr("differ"))));
    Grid moved = volume_.grid();
    moved.world_from_index[3].y += 5;
    EXPECT_THAT(belongs("j", with_grid(volume_, moved)),
                AllOf(HasSubstr("'volume' lies elsewhere (1 of the 12 numbers"),
                      Not(HasSubstr("differ in"))));
    {
        auto guided = Journal::create(file("guided"), Journal::base_of(with_guide(volume_)));
        ASSERT_TRUE(guided);
        JournalEntry entry = entries(1)[0];
        ASSERT_TRUE(guided->append(entry));
    }
    EXPECT_EQ(belongs("guided", volume_), ""); // no entry names the guide
    {
        auto guided = Journal::open(file("guided"), base_);
        JournalEntry entry = entries(1)[0];
        entry.guide = "guide";
        ASSERT_TRUE(guided->journal.append(entry));
    }
    EXPECT_THAT(belongs("guided", volume_), HasSubstr("begun with a 'guide', and none is given"));
    EXPECT_THAT(belongs("guided", with_guide(other)), HasSubstr("the samples of 'guide' differ"));
    EXPECT_EQ(belongs("guided", with_guide(volume_)), "");
    write("text", "some other file of a good many letters");
    EXPECT_THAT(belongs("text", volume_), HasSubstr("expected a journal"));
    std::string older = bytes_of("j");
    older[16] = '1';
    write("older", older);
    EXPECT_THAT(belongs("older", volume_), HasSubstr("expected a journal of version 2, found 1"));
    EXPECT_THAT(Journal::peek(file("older")).error().message, HasSubstr("version 2, found 1"));
    EXPECT_THAT(Journal::create(file("no/such/folder"), base_).error().message,
                HasSubstr("cannot be made"));
    ASSERT_TRUE(Journal::create(file("saved"), {.save = 7}));
    EXPECT_TRUE(Journal::open(file("saved"), {.save = 7}));
    EXPECT_THAT(Journal::open(file("saved"), {.save = 8}).error().message,
                HasSubstr("expected save 8 of a project, found save 7"));
    EXPECT_THAT(belongs("saved", volume_), HasSubstr("found save 7 of a project"));
}

// The limit on the size of files stands for a full disk.
TEST_F(JournalTest, AFullDiskLosesNothing) {
    const auto all = entries(3);
    Result<Journal> journal = Journal::create(file("j"), base_);
    ASSERT_TRUE(journal->append(all[0]));
    const size_t before = bytes_of("j").size();
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit old{};
    ::getrlimit(RLIMIT_FSIZE, &old);
    const rlimit little{before + 30, old.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &little);
    const Result<void> full = journal->append(all[1]);
    ::setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_FALSE(full);
    EXPECT_EQ(bytes_of("j").size(), before);
    ASSERT_TRUE(journal->append(all[2]));
    EXPECT_EQ(texts(Journal::peek(file("j"))->entries), texts({all[0], all[2]}));
}

} // namespace
} // namespace palpate
