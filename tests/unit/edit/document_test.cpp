// Documents of several volumes: every kind of step leads back and forth to the byte, and a journal
// done again gives the same document.

#include "engine/edit/document.h"

#include <gmock/gmock.h>

#include "engine/edit/editor.h"
#include "engine/edit/replay.h"
#include "engine/edit/step.h"
#include "engine/volume/builder.h"
#include "engine/volume/content_hash.h"
#include "tests/support/document_text.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/edit/twin.h"

namespace palpate {
namespace {

using testing::HasSubstr;

Volume random_volume(Random& random) {
    const Grid grid =
        make_grid(glm::uvec3(pick(random, 1, 70), pick(random, 1, 40), pick(random, 1, 40)),
                  glm::dvec3(uniform(random, 0.3, 3), 1, uniform(random, 0.3, 3)), {0.1, -7, 3});
    return pick(random, 0, 1) ? random_labels(random, grid, ScalarType::u16)
                              : random_greys(random, grid, ScalarType::f32);
}

// Another page of notes: it comes, goes or changes.
NotePages::Texts random_note(Random& random) {
    const int text = pick(random, 0, 3);
    return {{fmt::format("page{}", pick(random, 0, 2)),
             text == 0 ? "" : fmt::format("[\"{}\\n\u00e4\"]", text)}};
}

// Another document: volumes come, go, change, and are replaced by those of other grids; and notes.
Document random_change(Random& random, Document now) {
    if (pick(random, 0, 2) == 0)
        now.notes = now.notes.with(random_note(random));
    for (int n = pick(random, 0, 3); n > 0; --n) {
        const auto at = static_cast<size_t>(pick(random, 0, int(now.volumes.size()) - 1));
        NamedVolume& volume = now.volumes[at];
        switch (pick(random, 0, 4)) {
            case 0:
                now = with_volume(now, {fmt::format("v{}", pick(random, 0, 9)), VolumeKind::other,
                                        random_volume(random)});
                break;
            case 1:
                if (now.volumes.size() > 1)
                    now.volumes.erase(now.volumes.begin() + ptrdiff_t(at));
                break;
            case 2:
                volume.kind =
                    volume.kind == VolumeKind::grey ? VolumeKind::labels : VolumeKind::grey;
                break;
            default: {
                VolumeEdit edit(volume.volume);
                const glm::uvec3 size = volume.volume.size();
                for (int i = 0; i < 20; ++i)
                    edit.set({uint32_t(pick(random, 0, int(size.x) - 1)),
                              uint32_t(pick(random, 0, int(size.y) - 1)),
                              uint32_t(pick(random, 0, int(size.z) - 1))},
                             pick(random, 0, 100));
                volume.volume = edit.commit();
            }
        }
    }
    return now;
}

TEST(DocumentSteps, LeadBackAndForthToTheByte) {
    for (uint64_t seed = 0; seed < 20; ++seed) {
        Random random(seed);
        Document now(random_volume(random));
        History history;
        std::vector<std::string> all{all_of(now)};
        for (int i = 0; i < 20; ++i) {
            const Document next = random_change(random, now);
            const Step step = step_between(now, next);
            EXPECT_EQ(step.empty(), all_of(now) == all_of(next));
            const std::string packed = pack_step(step);
            for (const bool back : {false, true}) {
                const Document& from = back ? next : now;
                const std::string wanted = all_of(back ? now : next);
                ASSERT_EQ(all_of(*apply_step(from, step, back)), wanted) << seed << " " << i;
                const Result<Document> applied = apply_packed_step(from, packed, back);
                ASSERT_TRUE(applied) << applied.error().message;
                ASSERT_EQ(all_of(*applied), wanted) << seed << " " << i;
            }
            history.record(now, next);
            now = next;
            all.push_back(all_of(now));
        }
        for (size_t i = all.size() - 1; i-- > 0;) {
            if (i == all.size() / 2)
                history.settle(); // some steps as bricks, some packed
            now = **history.undo(now);
            ASSERT_EQ(all_of(now), all[i]);
        }
        for (size_t i = 1; i < all.size(); ++i) {
            now = **history.redo(now);
            ASSERT_EQ(all_of(now), all[i]);
        }
    }
}

// No bytes crash or make a volume of a size that nothing asked for.
TEST(DocumentSteps, DamagedOnesAreRefused) {
    Random random(3);
    const Document before(random_volume(random));
    Document after = with_volume(random_change(random, before),
                                 {"new", VolumeKind::labels, random_volume(random)});
    after.notes = NotePages().with({{"measures", "[1]"}});
    const std::string packed = pack_step(step_between(before, after));
    for (size_t i = 0; i < packed.size(); i += 1 + packed.size() / 400) {
        EXPECT_FALSE(apply_packed_step(before, packed.substr(0, i), false));
        std::string flipped = packed;
        flipped[i] ^= 1;
        (void)apply_packed_step(before, flipped, false); // a grid may be another one
    }
    EXPECT_FALSE(apply_packed_step(after, packed, false)); // the wrong side
    EXPECT_FALSE(apply_packed_step(before, packed, true));
}

TEST(Documents, NamesAreThoseOfFiles) {
    for (const char* name : {"a", "CT-1", "lung.left_2"})
        EXPECT_TRUE(check_volume_name(name)) << name;
    for (const char* name : {"", ".", "..", ".x", "a/b", "a b", "\xc3\xa4"})
        EXPECT_FALSE(check_volume_name(name)) << name;
    EXPECT_FALSE(check_volume_name(std::string(65, 'a')));
}

// The editor without a thread, and two or more journals one after the other, as saves leave them:
// what each journal gives, done on what was there when it began, is the document; at every moment.
class JournalledDocument : public TemporaryFolder {
 protected:
    struct Saved {
        Document base;
        std::string journal;
    };

    static Document replayed(const Saved& saved, const std::filesystem::path& path) {
        Document now = saved.base;
        History history;
        const auto contents = Journal::peek(path);
        EXPECT_TRUE(contents) << contents.error().message;
        for (const JournalEntry& entry : contents->entries) {
            const auto done = replay(now, history, entry, {});
            EXPECT_TRUE(done) << done.error().message;
        }
        return now;
    }
};

TEST_F(JournalledDocument, IsWhatItsJournalGivesAtEveryMoment) {
    for (uint64_t seed = 0; seed < 6; ++seed) {
        Random random(seed);
        const Grid grid = make_grid({40, 30, 20}, {1, 1, 1.5});
        const Document first = *make_document(
            {{"ct", VolumeKind::grey, random_greys(random, grid, ScalarType::i16)},
             {"organs", VolumeKind::labels, random_labels(random, grid, ScalarType::u8)}});
        uint64_t saves = 1;
        Saved saved{first, fmt::format("j{}-{}", seed, saves)};
        Editor editor(first, {.journal = *Journal::create(file(saved.journal), {.save = saves}),
                              .threaded = false});
        auto reader = editor.add_reader();
        uint64_t number = 0;
        std::vector<std::string> past{all_of(first)}; // what undo leads to
        size_t depth = 0;
        Document earlier = first;
        const auto done = [&](const std::string& state) {
            past.resize(++depth);
            past.push_back(state);
        };
        for (int i = 0; i < 40; ++i) {
            const int what = pick(random, 0, 11);
            if (what < 4) { // a stroke on one of the two, the labels perhaps by the values
                const bool labels = pick(random, 0, 1);
                Operation op =
                    random_operation(random, labels ? OperationKind::draw : OperationKind::cut);
                op.only_values.reset();
                if (pick(random, 0, 1))
                    op.only_values = {0.0, 500.0};
                Json ball = *parse_json(R"({"kind": "ball", "radius_mm": 4})", "");
                editor.use(
                    {ball, {make_ball(4)}, op, labels ? "organs" : "ct", labels ? "ct" : ""});
                const auto path = random_path(random, grid, 5);
                for (size_t k = 0; k < path.size(); ++k)
                    editor.push({k == 0                 ? EditInput::Kind::down
                                 : k + 1 == path.size() ? EditInput::Kind::up
                                                        : EditInput::Kind::move,
                                 path[k], ++number, 0});
                editor.settle();
                ASSERT_EQ(reader.pin()->refusal, "");
                done(all_of(reader.pin()->document));
            } else if (what >= 10) { // notes; those that stay what they are make no step
                const NotePages before = reader.pin()->document.notes;
                const NotePages::Texts pages = random_note(random);
                editor.note(pages, "note");
                editor.settle();
                ASSERT_EQ(reader.pin()->refusal, "");
                if (before.with(pages) != before)
                    done(all_of(reader.pin()->document));
            } else if (what < 6) { // a filter's result, of a grid of its own, perhaps with notes
                editor.put({fmt::format("v{}", pick(random, 0, 2)), VolumeKind::other,
                            random_volume(random)},
                           "median", {{"radius_mm", 2.0}},
                           pick(random, 0, 1) ? random_note(random) : NotePages::Texts());
                editor.settle();
                ASSERT_EQ(reader.pin()->refusal, "");
                done(all_of(reader.pin()->document));
            } else if (what < 9) {
                const bool back = pick(random, 0, 2) > 0;
                const bool possible = back ? depth > 0 : depth + 1 < past.size();
                (void)(back ? editor.undo() : editor.redo());
                editor.settle();
                ASSERT_EQ(reader.pin()->refusal.empty(), possible);
                if (possible)
                    depth += back ? -1 : 1;
            } else {
                // At its turn, or of an earlier state that its first entry leads on from.
                const std::string name = fmt::format("j{}-{}", seed, ++saves);
                std::optional<Document> from;
                if (pick(random, 0, 1))
                    from = earlier;
                auto reached =
                    editor.change_journal(*Journal::create(file(name), {.save = saves}), from);
                editor.settle();
                const Document at_its_turn = reached->wait({}).value();
                saved = {from.value_or(at_its_turn), name};
            }
            const Document now = reader.pin()->document;
            if (pick(random, 0, 3) == 0)
                earlier = now;
            ASSERT_EQ(all_of(now), past[depth]) << seed << " " << i;
            ASSERT_EQ(all_of(replayed(saved, file(saved.journal))), all_of(now))
                << seed << " " << i;
        }
    }
}

// A note that is no step is there after undo and redo of those before it, and in the journal.
TEST_F(JournalledDocument, KeepsNotesThatAreNoSteps) {
    Random random(5);
    const Document first(random_volume(random));
    const Saved saved{first, "j"};
    Editor editor(first, {.journal = *Journal::create(file("j"), {.save = 1}), .threaded = false});
    auto reader = editor.add_reader();
    editor.note({{"names", "[1]"}}, "name");
    editor.note({{"names", "[2]"}}, "name");
    editor.undo();
    editor.note({{"window", "[0,1]"}}, "window", false);
    editor.settle();
    EXPECT_EQ(reader.pin()->undo_steps, 1u);
    EXPECT_EQ(reader.pin()->redo_steps, 1u);
    editor.redo();
    editor.settle();
    const NotePages both({{"names", "[2]"}, {"window", "[0,1]"}});
    EXPECT_EQ(reader.pin()->document.notes, both);
    EXPECT_EQ(replayed(saved, file("j")).notes, both);
    editor.undo();
    editor.undo();
    editor.settle();
    EXPECT_EQ(reader.pin()->document.notes, NotePages().with({{"window", "[0,1]"}}));
    EXPECT_EQ(all_of(replayed(saved, file("j"))), all_of(reader.pin()->document));
}

// An editor that goes on from a journal has its steps, too.
TEST_F(JournalledDocument, GoesOnWithTheStepsOfItsJournal) {
    Random random(7);
    const Document first(random_volume(random));
    const Document second = with_volume(first, {"more", VolumeKind::other, random_volume(random)});
    const auto path = file("j");
    {
        Editor editor(
            first, {.journal = *Journal::create(path, Journal::base_of(first)), .threaded = false});
        editor.put(second.volumes[1], "threshold");
        editor.settle();
    }
    auto found = Journal::open(path, Journal::base_of(first));
    ASSERT_TRUE(found);
    ASSERT_EQ(found->entries.size(), 1u);
    EXPECT_EQ(found->entries[0].change.title, "threshold");
    Document now = first;
    auto history = std::make_unique<History>();
    ASSERT_TRUE(replay(now, *history, found->entries[0], {}));
    EXPECT_EQ(all_of(now), all_of(second));
    {
        Editor editor(
            now,
            {.begun = std::move(history), .journal = std::move(found->journal), .threaded = false});
        auto reader = editor.add_reader();
        EXPECT_EQ(reader.pin()->undo_steps, 1u);
        editor.undo();
        editor.settle();
        EXPECT_EQ(all_of(reader.pin()->document), all_of(first));
        editor.remove("volume");
        editor.settle();
        EXPECT_THAT(reader.pin()->refusal, HasSubstr("the last volume"));
        editor.remove("other");
        editor.settle();
        EXPECT_THAT(reader.pin()->refusal, HasSubstr("one of the volumes 'volume', found 'other'"));
        editor.put({"a/b", VolumeKind::other, first.first()}, "x");
        editor.settle();
        EXPECT_THAT(reader.pin()->refusal, HasSubstr("found 'a/b'"));
    }
    const auto kept = Journal::peek(path);
    ASSERT_EQ(kept->entries.size(), 2u);
    EXPECT_EQ(kept->entries[1].kind, JournalEntry::Kind::undo);
}

TEST(Document, OfVolumesThatDoNotGoTogetherIsRefused) {
    const Volume volume = make_volume(make_grid({2, 2, 2}, glm::dvec3(1)), ScalarType::u8,
                                      [](glm::uvec3) { return 0.0; });
    const auto why = [&](const std::vector<std::string>& names) {
        std::vector<NamedVolume> volumes;
        for (const std::string& name : names)
            volumes.push_back({name, VolumeKind::grey, volume});
        const Result<Document> made = make_document(std::move(volumes));
        return made ? fmt::format("{} volumes", made->volumes.size()) : made.error().message;
    };
    EXPECT_EQ(why({"head", "liver"}), "2 volumes");
    EXPECT_EQ(why({}), "a document: expected at least one volume, found none");
    EXPECT_EQ(why({"head", "head"}), "a document: expected names that differ, found 'head' twice");
    EXPECT_THAT(why({"head", "../x"}), HasSubstr("found '../x'"));
}

} // namespace
} // namespace palpate
