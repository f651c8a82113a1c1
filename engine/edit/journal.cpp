#include "engine/edit/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>

#include "engine/base/file.h"
#include "engine/base/printable.h"
#include "engine/edit/journal_records.h"
#include "engine/volume/content_hash.h"

namespace palpate {

namespace {

constexpr uint64_t kMostBytes = (uint64_t{4} << 30) - 1; // so that lengths have 32 bits

tl::unexpected<Error> too_large(const std::filesystem::path& path) {
    return fail("{}: expected at most {} GiB in a journal, found more", path.string(),
                (kMostBytes + 1) >> 30);
}

Json base_json(const Journal::Base& base) {
    if (base.save > 0)
        return {{"save", base.save}};
    Json volumes = Json::array();
    for (const Journal::Base::Entry& volume : base.volumes) {
        Json matrix = Json::array();
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column)
                matrix.push_back(volume.grid.world_from_index[column][row]);
        volumes.push_back({{"name", volume.name},
                           {"hash", fmt::format("{:016x}", volume.hash)},
                           {"world_from_index", std::move(matrix)}});
    }
    return {{"volumes", std::move(volumes)}};
}

// The difference between a volume as a journal knows it and as it is given, in words; else empty.
std::string difference(const Json& found, const Json& wanted) {
    std::string text;
    if (json_line(*found.find("hash")) != json_line(*wanted.find("hash")))
        text = fmt::format("the samples of '{}' differ in number, type or value",
                           wanted.find("name")->string);
    const std::vector<Json>&is = found.find("world_from_index")->items,
          &want = wanted.find("world_from_index")->items;
    size_t moved = 0, first = 0;
    for (size_t i = 0; i < std::min(is.size(), want.size()); ++i)
        if (is[i].number != want[i].number && ++moved == 1)
            first = i;
    if (moved > 0)
        text += fmt::format(
            "{}'{}' lies elsewhere ({} of the 12 numbers of its position matrix differ, the first "
            "is {} where it was {})",
            text.empty() ? "" : "; ", wanted.find("name")->string, moved, want[first].number,
            is[first].number);
    return text;
}

// The difference between the first line of a journal and the given base, in words.
std::string difference(std::string_view first, const Journal::Base& base) {
    const Result<Json> found = parse_json(first, "journal");
    const Json wanted = base_json(base);
    const Json* there = found ? found->find("volumes") : nullptr;
    if (base.save > 0 || !there) {
        const Json* save = found ? found->find("save") : nullptr;
        const bool same = save && save->number == static_cast<double>(base.save);
        return same            ? ""
               : !save         ? (there ? "expected a project's, found one of volumes"
                                        : "its first line is in no form that this program writes")
               : base.save > 0 ? fmt::format("expected save {} of a project, found save {}",
                                             base.save, save->number)
                               : fmt::format("expected one of volumes, found save {} of a project",
                                             save->number);
    }
    std::string text;
    const auto add = [&](const std::string& what) {
        text += what.empty() || text.empty() ? what : "; " + what;
    };
    for (const Json& volume : wanted.find("volumes")->items) {
        const auto is = std::find_if(there->items.begin(), there->items.end(), [&](const Json& v) {
            return v.find("name") && v.find("hash") && v.find("world_from_index") &&
                   v.find("name")->string == volume.find("name")->string;
        });
        add(is == there->items.end() ? fmt::format("it was begun without a '{}', and one is given",
                                                   volume.find("name")->string)
                                     : difference(*is, volume));
    }
    return text;
}

// Zeros at the end that are more than the rest of a sector: what a write that never ended leaves,
// or steps that were there.
constexpr size_t kSector = 512;
size_t zeros_at_end(std::string_view file) {
    const size_t zeros = file.size() - (file.find_last_not_of('\0') + 1);
    return zeros < kSector ? 0 : zeros;
}

std::optional<Journal::Damage> damage_by_zeros(std::string_view file, size_t at) {
    const size_t zeros = std::min(zeros_at_end(file), file.size() - at);
    if (zeros < kSector)
        return {};
    return Journal::Damage{
        at, fmt::format("expected a step, found {} bytes of zeros", zeros), 0, {}};
}

// The offset of the records: the file's end where the first line itself is cut, or where zeros
// stand that it was never written over. An error where the file begins in another way.
Result<size_t> begin_of_records(std::string_view file, const std::filesystem::path& path) {
    if (file.starts_with(kJournalMagic))
        return kJournalMagic.size();
    const std::string_view start = file.substr(0, file.find_last_not_of('\0') + 1);
    if (start.size() < kJournalMagic.size() && kJournalMagic.starts_with(start))
        return file.size();
    if (file.starts_with(kAnyMagic)) {
        const std::string_view version = file.substr(kAnyMagic.size()).substr(0, 8);
        return fail(
            "{}: expected a journal of version 2, found {}; the palpate that wrote it can recover "
            "it",
            path.string(), printable(version.substr(0, version.find('\n'))));
    }
    const size_t steps = count_steps(file, 0);
    if (steps == 0 && file.front() != '\0')
        return fail("{}: expected a journal of palpate, found something else", path.string());
    const size_t zeros = std::min(file.find_first_not_of('\0'), file.size());
    return fail(
        "{}: damaged at byte 0: expected the first line of a journal, found {}; it stays as it is, "
        "with {} step{} that could be read",
        path.string(), zeros > 0 ? fmt::format("{} bytes of zeros", zeros) : "something else",
        steps, steps == 1 ? "" : "s");
}

// Whether a file made just now in this folder is there after a loss of power too.
bool keep_name(const std::filesystem::path& path) {
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    const Fd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!fd)
        return errno == EACCES; // a folder to write to and not to look into
    // EINVAL: a file system whose folders have none
    return ::fsync(fd.get()) == 0 || errno == EINVAL || errno == EROFS;
}

// Whether another has the file at fd; else it is ours alone until fd is closed. A file system that
// knows no locks refuses none.
bool is_locked(const Fd& fd) {
    int failed = 0;
    do
        failed = ::flock(fd.get(), LOCK_EX | LOCK_NB);
    while (failed && errno == EINTR);
    return failed && errno == EWOULDBLOCK;
}

Result<void> lock(const Fd& fd, const std::filesystem::path& path) {
    if (is_locked(fd))
        return fail("{}: expected the journal of an edit that has ended, found one that is running",
                    path.string());
    struct stat found {};
    if (::fstat(fd.get(), &found) == 0 && found.st_nlink == 0) // it ended, and took it away
        return fail("{}: no such file", path.string());
    return {};
}

// A copy of what a journal was, under the first name that is free or holds the same.
Result<std::filesystem::path> keep_copy(const std::filesystem::path& path,
                                        const std::string& bytes) {
    for (int n = 1;; ++n) {
        std::filesystem::path copy = path;
        copy += n == 1 ? ".damaged" : fmt::format(".damaged-{}", n);
        std::error_code error;
        if (std::filesystem::exists(copy, error)) {
            if (const Result<std::string> there = load_text(copy, kMostBytes);
                there && *there == bytes)
                return copy;
            continue;
        }
        PALPATE_TRY(save_bytes(copy, std::as_bytes(std::span(bytes))));
        return copy;
    }
}

// Tells in words the first volume that the entries name and the document lacks; else empty.
std::string missing(const std::vector<JournalEntry>& entries, const Journal::Base& base) {
    if (base.save > 0)
        return {};
    std::vector<std::string> known; // volumes that entries make are
    for (const Journal::Base::Entry& volume : base.volumes)
        known.push_back(volume.name);
    for (const JournalEntry& entry : entries) {
        if (entry.kind == JournalEntry::Kind::change)
            return {};
        if (entry.kind == JournalEntry::Kind::stroke)
            for (const std::string& name : {entry.on, entry.guide})
                if (!name.empty() && std::find(known.begin(), known.end(), name) == known.end())
                    return fmt::format("it was begun with a '{}', and none is given", name);
    }
    return {};
}

// Moves `at` behind the last whole one.
Result<Journal::Contents> read_entries(std::string_view text, size_t& at,
                                       const std::filesystem::path& path) {
    Journal::Contents contents;
    while (const std::optional<std::string_view> payload = next_record(text, at)) {
        PALPATE_TRY(JournalEntry entry, parse_entry(*payload, path.string()));
        contents.entries.push_back(std::move(entry));
    }
    const JournalTail tail = tail_of(text, at);
    contents.cut = tail.kind == JournalTail::Kind::unfinished;
    if (tail.kind == JournalTail::Kind::damaged)
        contents.damage = {at, tail.what, tail.later, {}};
    else if (contents.cut)
        contents.damage = damage_by_zeros(text, at);
    return contents;
}

// The first record says what the others belong to.
Result<void> expect_no_damage_at_start(std::string_view text, size_t at,
                                       const std::filesystem::path& path) {
    const JournalTail tail = tail_of(text, at);
    if (tail.kind != JournalTail::Kind::damaged)
        return {};
    return fail(
        "{}: damaged at byte {}, where it says which volume it belongs to: {}; it stays as it is, "
        "with {} step{} that could be read",
        path.string(), at, tail.what, tail.later, tail.later == 1 ? "" : "s");
}

} // namespace

Journal::Base Journal::base_of(const Document& document) {
    Base base;
    for (const NamedVolume& volume : document.volumes)
        base.volumes.push_back({volume.name, content_hash(volume.volume), volume.volume.grid()});
    return base;
}

Result<Journal> Journal::create(const std::filesystem::path& path, const Base& base) {
    constexpr int kNew = O_RDWR | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC;
    Journal journal(path, Fd(::open(path.c_str(), kNew, 0666)));
    if (!journal.fd_)
        return fail("{}: cannot be made: {}", path.string(), std::strerror(errno));
    PALPATE_TRY(lock(journal.fd_, path)); // and theirs is the file
    Result<void> begun = journal.begin(base);
    if (begun && !keep_name(path))
        begun = fail("{}: its folder cannot be written: {}", path.string(), std::strerror(errno));
    if (!begun) {
        ::unlink(path.c_str());
        return pass_on(begun);
    }
    return journal;
}

Result<void> Journal::begin(const Base& base) {
    // The magic belongs to the first record, so that a journal cut in its first breath is told
    // from a foreign file by its beginning.
    if (::ftruncate(fd_.get(), 0) != 0 || !write_all(fd_, std::as_bytes(std::span(kJournalMagic))))
        return fail("{}: cannot be written: {}", path_.string(), std::strerror(errno));
    end_ = kJournalMagic.size();
    return write_records(record_of(json_line(base_json(base)) + "\n"));
}

Result<Journal::Found> Journal::open(const std::filesystem::path& path, const Base& base) {
    Journal journal(path, Fd(::open(path.c_str(), O_RDWR | O_APPEND | O_CLOEXEC)));
    if (!journal.fd_)
        return fail("{}: cannot be written: {}", path.string(), std::strerror(errno));
    PALPATE_TRY(lock(journal.fd_, path));
    PALPATE_TRY(const std::string file, load_text(path, kMostBytes));
    const std::string_view text(file);
    PALPATE_TRY(size_t at, begin_of_records(text, path));
    const std::optional<std::string_view> first = next_record(text, at);
    if (!first) { // ended before the first entry could be: begin anew
        PALPATE_TRY(expect_no_damage_at_start(text, at, path));
        std::optional<Damage> damage = damage_by_zeros(text, 0);
        if (damage) {
            PALPATE_TRY(damage->kept_as, keep_copy(path, file));
        }
        PALPATE_TRY(journal.begin(base));
        return Found{{{}, true, std::move(damage)}, std::move(journal)};
    }
    if (const std::string differs = difference(*first, base); !differs.empty())
        return fail("{}: belongs to another edit: {}", path.string(), differs);
    PALPATE_TRY(Contents contents, read_entries(text, at, path));
    if (const std::string lacks = missing(contents.entries, base); !lacks.empty())
        return fail("{}: belongs to another edit: {}", path.string(), lacks);
    if (contents.damage) {
        PALPATE_TRY(contents.damage->kept_as, keep_copy(path, file));
    }
    if (at < text.size() && ::ftruncate(journal.fd_.get(), static_cast<off_t>(at)) != 0)
        return fail("{}: cannot be written: {}", path.string(), std::strerror(errno));
    journal.end_ = at;
    return Found{std::move(contents), std::move(journal)};
}

Result<Journal::Contents> Journal::peek(const std::filesystem::path& path) {
    PALPATE_TRY(const std::string file, load_text(path, kMostBytes));
    PALPATE_TRY(size_t at, begin_of_records(file, path));
    if (!next_record(file, at)) {
        PALPATE_TRY(expect_no_damage_at_start(file, at, path));
        return Contents{{}, false, damage_by_zeros(file, 0)};
    }
    return read_entries(file, at, path);
}

bool Journal::is_running(const std::filesystem::path& path) {
    const Fd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    return fd && is_locked(fd);
}

Result<void> Journal::expect_ended(const std::filesystem::path& path) {
    const Fd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!fd)
        return fail("{}: cannot be read: {}", path.string(), std::strerror(errno));
    return lock(fd, path);
}

Result<void> Journal::discard(const std::filesystem::path& path) {
    const auto failed = [&] {
        return fail("{}: cannot be taken away: {}", path.string(), std::strerror(errno));
    };
    const Fd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!fd)
        return failed();
    PALPATE_TRY(lock(fd, path));
    if (::unlink(path.c_str()) != 0)
        return failed();
    return {};
}

Result<void> Journal::append(std::span<const JournalEntry> entries) {
    std::string records;
    for (const JournalEntry& entry : entries) {
        const std::string text = entry.text();
        if (text.size() > kMostBytes)
            return too_large(path_);
        records += record_of(text);
    }
    return write_records(records);
}

Result<void> Journal::write_records(const std::string& records) {
    const auto failed = [&](int reason) {
        return fail("{}: cannot be written: {}", path_.string(), std::strerror(reason));
    };
    // A reader stops at a torn record, so nothing may follow it.
    if (torn_ && ::ftruncate(fd_.get(), static_cast<off_t>(end_)) != 0)
        return failed(errno);
    torn_ = false;
    if (end_ + records.size() > kMostBytes)
        return too_large(path_);
    if (!write_all(fd_, std::as_bytes(std::span(records))) || ::fdatasync(fd_.get()) != 0) {
        const int reason = errno;
        torn_ = ::ftruncate(fd_.get(), static_cast<off_t>(end_)) != 0;
        return failed(reason);
    }
    end_ += records.size();
    return {};
}

void Journal::remove() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
}

} // namespace palpate
