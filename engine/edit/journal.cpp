#include "engine/edit/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <span>
#include <sstream>

#include "engine/base/file.h"
#include "engine/edit/journal_records.h"
#include "engine/volume/content_hash.h"

namespace palpate {

namespace {

constexpr uint64_t kMostBytes = uint64_t{4} << 30;

std::string base_text(const Journal::Base& base) {
    std::string text =
        fmt::format("base {:016x} guide {:016x} grid", base.volume_hash, base.guide_hash);
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
            text += fmt::format(" {}", base.grid.world_from_index[column][row]);
    return text;
}

// What differs between the first line of a journal and the volumes that are given, in words.
std::string difference(std::string_view found, const Journal::Base& base) {
    const auto words = [](std::string_view text) {
        std::vector<std::string> all;
        std::istringstream in{std::string(text)};
        for (std::string word; in >> word;)
            all.push_back(word);
        return all;
    };
    const std::vector<std::string> is = words(found), wanted = words(base_text(base));
    if (is.size() != wanted.size())
        return "its first line is in no form that this program writes";
    std::string text;
    const auto add = [&](bool differs, std::string_view what) {
        if (differs)
            text += fmt::format("{}{}", text.empty() ? "" : "; ", what);
    };
    const bool had_guide = is[3] != fmt::format("{:016x}", 0), has_guide = base.guide_hash != 0;
    add(is[1] != wanted[1], "the volume's samples differ in number, type or value");
    add(had_guide && !has_guide, "it was begun with a guide, and none is given");
    add(!had_guide && has_guide, "it was begun without a guide, and one is given");
    add(had_guide && has_guide && is[3] != wanted[3],
        "the guide's samples differ in number, type or value");
    std::vector<std::string> moved;
    for (size_t i = 5; i < is.size(); ++i)
        if (is[i] != wanted[i])
            moved.push_back(fmt::format("{} where it was {}", wanted[i], is[i]));
    if (!moved.empty())
        add(true, fmt::format("the volume lies elsewhere ({} of the 12 numbers of its position "
                              "matrix differ, the first is {})",
                              moved.size(), moved.front()));
    return text;
}

bool write_all(int fd, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t n = ::write(fd, bytes.data(), bytes.size());
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return false;
        bytes.remove_prefix(static_cast<size_t>(n));
    }
    return true;
}

// Whether a file made just now in this folder is there after a loss of power too.
bool keep_name(const std::filesystem::path& path) {
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0)
        return errno == EACCES; // a folder to write to and not to look into
    const bool failed = ::fsync(fd) != 0 && errno != EINVAL && errno != EROFS;
    const int reason = errno; // EINVAL: a file system whose folders have none
    ::close(fd);
    errno = reason;
    return !failed;
}

// The file at fd is ours alone until fd is closed. A file system that knows no locks refuses none.
Result<void> lock(int fd, const std::filesystem::path& path) {
    int failed = 0;
    do
        failed = ::flock(fd, LOCK_EX | LOCK_NB);
    while (failed && errno == EINTR);
    if (failed && errno == EWOULDBLOCK)
        return fail("{}: expected the journal of an edit that has ended, found one that is running",
                    path.string());
    struct stat found {};
    if (::fstat(fd, &found) == 0 && found.st_nlink == 0) // it ended, and took it away
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
        if (Result<void> kept = save_bytes(copy, std::as_bytes(std::span(bytes))); !kept)
            return pass_on(kept);
        return copy;
    }
}

// Moves `at` behind the last whole one.
Result<Journal::Contents> read_entries(std::string_view text, size_t& at,
                                       const std::filesystem::path& path) {
    Journal::Contents contents;
    while (const std::optional<std::string_view> payload = next_record(text, at)) {
        JournalEntry entry;
        if (*payload == "undo\n") {
            entry.kind = JournalEntry::Kind::undo;
        } else if (*payload == "redo\n") {
            entry.kind = JournalEntry::Kind::redo;
        } else {
            Result<std::vector<Stroke>> strokes = parse_strokes(*payload, path.string());
            if (!strokes)
                return pass_on(strokes);
            if (strokes->size() != 1)
                return fail("{}: expected one stroke an entry, found {}", path.string(),
                            strokes->size());
            entry.stroke = std::move(strokes->front());
        }
        contents.entries.push_back(std::move(entry));
    }
    const JournalTail tail = tail_of(text, at);
    contents.cut = tail.kind == JournalTail::Kind::unfinished;
    if (tail.kind == JournalTail::Kind::damaged)
        contents.damage = {at, tail.what, tail.later, {}};
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

std::string JournalEntry::text() const {
    switch (kind) {
        case Kind::undo:
            return "undo\n";
        case Kind::redo:
            return "redo\n";
        case Kind::stroke:
            break;
    }
    return stroke_text(stroke);
}

Journal::Base Journal::base_of(const Volume& volume, const Volume* guide) {
    return {content_hash(volume), guide ? content_hash(*guide) : 0, volume.grid()};
}

Journal::Journal(std::filesystem::path path, int fd, uint64_t end)
    : path_(std::move(path)), fd_(fd), end_(end) {}

Journal::Journal(Journal&& other) noexcept
    : path_(std::move(other.path_)),
      fd_(std::exchange(other.fd_, -1)),
      end_(other.end_),
      torn_(other.torn_) {}

Journal::~Journal() {
    if (fd_ >= 0)
        ::close(fd_);
}

Result<Journal> Journal::create(const std::filesystem::path& path, const Base& base) {
    const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
    if (fd < 0)
        return fail("{}: cannot be made: {}", path.string(), std::strerror(errno));
    Journal journal(path, fd, 0);
    if (Result<void> ours = lock(fd, path); !ours) // and theirs is the file
        return pass_on(ours);
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
    if (::ftruncate(fd_, 0) != 0 || !write_all(fd_, kJournalMagic))
        return fail("{}: cannot be written: {}", path_.string(), std::strerror(errno));
    end_ = kJournalMagic.size();
    return write_record(base_text(base));
}

Result<Journal::Found> Journal::open(const std::filesystem::path& path, const Base& base) {
    const int fd = ::open(path.c_str(), O_RDWR | O_APPEND | O_CLOEXEC);
    if (fd < 0)
        return fail("{}: cannot be written: {}", path.string(), std::strerror(errno));
    Journal journal(path, fd, 0);
    if (Result<void> ours = lock(fd, path); !ours)
        return pass_on(ours);
    Result<std::string> file = load_text(path, kMostBytes);
    if (!file)
        return pass_on(file);
    const std::string_view text(*file);
    // The magic itself may be cut, or zeros that it was never written over.
    const std::string_view start = text.substr(0, text.find_last_not_of('\0') + 1);
    const bool torn_start = start.size() < kJournalMagic.size() && kJournalMagic.starts_with(start);
    if (!torn_start && !text.starts_with(kJournalMagic))
        return fail("{}: expected a journal of palpate edit, found something else", path.string());
    size_t at = torn_start ? text.size() : kJournalMagic.size();
    const std::optional<std::string_view> first = next_record(text, at);
    if (!first) { // ended before the first entry could be: begin anew
        if (Result<void> whole = expect_no_damage_at_start(text, at, path); !whole)
            return pass_on(whole);
        if (Result<void> begun = journal.begin(base); !begun)
            return pass_on(begun);
        return Found{{{}, true, {}}, std::move(journal)};
    }
    if (*first != base_text(base))
        return fail("{}: belongs to another edit: {}", path.string(), difference(*first, base));
    Result<Contents> contents = read_entries(text, at, path);
    if (!contents)
        return pass_on(contents);
    if (contents->damage) {
        Result<std::filesystem::path> copy = keep_copy(path, *file);
        if (!copy)
            return pass_on(copy);
        contents->damage->kept_as = *copy;
    }
    if (at < text.size() && ::ftruncate(fd, static_cast<off_t>(at)) != 0)
        return fail("{}: cannot be written: {}", path.string(), std::strerror(errno));
    journal.end_ = at;
    return Found{std::move(*contents), std::move(journal)};
}

Result<Journal::Contents> Journal::peek(const std::filesystem::path& path) {
    Result<std::string> file = load_text(path, kMostBytes);
    if (!file)
        return pass_on(file);
    size_t at = kJournalMagic.size();
    if (!file->starts_with(kJournalMagic))
        return Contents();
    if (!next_record(*file, at)) {
        if (Result<void> whole = expect_no_damage_at_start(*file, at, path); !whole)
            return pass_on(whole);
        return Contents();
    }
    return read_entries(*file, at, path);
}

Result<void> Journal::expect_ended(const std::filesystem::path& path) {
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        return fail("{}: cannot be read: {}", path.string(), std::strerror(errno));
    const Result<void> free = lock(fd, path);
    ::close(fd);
    return free;
}

Result<void> Journal::discard(const std::filesystem::path& path) {
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        return fail("{}: cannot be taken away: {}", path.string(), std::strerror(errno));
    Result<void> done = lock(fd, path);
    if (done && ::unlink(path.c_str()) != 0)
        done = fail("{}: cannot be taken away: {}", path.string(), std::strerror(errno));
    ::close(fd);
    return done;
}

Result<void> Journal::append(const JournalEntry& entry) {
    return write_record(entry.text());
}

Result<void> Journal::write_record(const std::string& payload) {
    const auto failed = [&](int reason) {
        return fail("{}: cannot be written: {}", path_.string(), std::strerror(reason));
    };
    // Behind what is torn nobody would read on.
    if (torn_ && ::ftruncate(fd_, static_cast<off_t>(end_)) != 0)
        return failed(errno);
    torn_ = false;
    const std::string record = record_of(payload);
    if (!write_all(fd_, record) || ::fdatasync(fd_) != 0) {
        const int reason = errno;
        torn_ = ::ftruncate(fd_, static_cast<off_t>(end_)) != 0;
        return failed(reason);
    }
    end_ += record.size();
    return {};
}

void Journal::remove() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
}

} // namespace palpate
