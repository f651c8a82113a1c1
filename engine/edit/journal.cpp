#include "engine/edit/journal.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>

#include "engine/base/file.h"
#include "engine/volume/content_hash.h"

namespace palpate {

namespace {

constexpr std::string_view kMagic = "palpate journal 1\n";
constexpr uint64_t kMostBytes = uint64_t{4} << 30;

struct RecordHeader {
    uint32_t bytes, crc;
};

uint32_t crc_of(std::string_view bytes) {
    return static_cast<uint32_t>(
        ::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string base_text(const Journal::Base& base) {
    std::string text =
        fmt::format("base {:016x} guide {:016x} grid", base.volume_hash, base.guide_hash);
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
            text += fmt::format(" {}", base.grid.world_from_index[column][row]);
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

// The payload of the record at `at`, which moves behind it; nothing where it is not whole. No
// payload is empty: zeros, which a file may end in after a loss of power, are no record though
// the CRC of nothing is 0.
std::optional<std::string_view> next_record(std::string_view file, size_t& at) {
    RecordHeader header;
    if (file.size() - at < sizeof header)
        return std::nullopt;
    std::memcpy(&header, file.data() + at, sizeof header);
    if (header.bytes == 0 || file.size() - at - sizeof header < header.bytes)
        return std::nullopt;
    const std::string_view payload = file.substr(at + sizeof header, header.bytes);
    if (crc_of(payload) != header.crc)
        return std::nullopt;
    at += sizeof header + header.bytes;
    return payload;
}

// Moves `at` behind the last whole one.
Result<std::vector<JournalEntry>> read_entries(std::string_view text, size_t& at,
                                               const std::filesystem::path& path) {
    std::vector<JournalEntry> entries;
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
        entries.push_back(std::move(entry));
    }
    return entries;
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
    const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
    if (fd < 0)
        return fail("{}: cannot be made: {}", path.string(), std::strerror(errno));
    Journal journal(path, fd, 0);
    // The magic belongs to the first record, so that a journal cut in its first breath is told
    // from a foreign file by its beginning.
    if (!write_all(fd, kMagic)) {
        const int reason = errno;
        ::unlink(path.c_str());
        return fail("{}: cannot be written: {}", path.string(), std::strerror(reason));
    }
    journal.end_ = kMagic.size();
    if (Result<void> written = journal.write_record(base_text(base)); !written) {
        ::unlink(path.c_str());
        return tl::unexpected(written.error());
    }
    if (!keep_name(path)) {
        const int reason = errno;
        ::unlink(path.c_str());
        return fail("{}: its folder cannot be written: {}", path.string(), std::strerror(reason));
    }
    return journal;
}

Result<Journal::Found> Journal::open(const std::filesystem::path& path, const Base& base) {
    const Result<std::string> file = load_text(path, kMostBytes);
    if (!file)
        return tl::unexpected(file.error());
    const std::string_view text(*file);
    // The magic itself may be cut, or zeros that it was never written over.
    const std::string_view start = text.substr(0, text.find_last_not_of('\0') + 1);
    const bool torn_start = start.size() < kMagic.size() && kMagic.starts_with(start);
    if (!torn_start && !text.starts_with(kMagic))
        return fail("{}: expected a journal of palpate edit, found something else", path.string());
    size_t at = torn_start ? text.size() : kMagic.size();
    const std::optional<std::string_view> first = next_record(text, at);
    if (!first) { // ended before the first entry could be: begin anew
        std::error_code error;
        if (!std::filesystem::remove(path, error))
            return fail("{}: cannot be taken away: {}", path.string(), error.message());
        Result<Journal> made = create(path, base);
        if (!made)
            return pass_on(made);
        return Found{std::move(*made), {}, true};
    }
    if (*first != base_text(base))
        return fail(
            "{}: belongs to another volume, guide or place than those given: expected "
            "\"{}\", found \"{}\"",
            path.string(), base_text(base), *first);
    Result<std::vector<JournalEntry>> entries = read_entries(text, at, path);
    if (!entries)
        return pass_on(entries);
    const int fd = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
    if (fd < 0)
        return fail("{}: cannot be written: {}", path.string(), std::strerror(errno));
    Journal journal(path, fd, at);
    const bool cut = at < text.size();
    if (cut && ::ftruncate(fd, static_cast<off_t>(at)) != 0)
        return fail("{}: cannot be written: {}", path.string(), std::strerror(errno));
    return Found{std::move(journal), std::move(*entries), cut};
}

Result<std::vector<JournalEntry>> Journal::peek(const std::filesystem::path& path) {
    const Result<std::string> file = load_text(path, kMostBytes);
    if (!file)
        return tl::unexpected(file.error());
    size_t at = kMagic.size();
    if (!file->starts_with(kMagic) || !next_record(*file, at))
        return std::vector<JournalEntry>();
    return read_entries(*file, at, path);
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
    const RecordHeader header{static_cast<uint32_t>(payload.size()), crc_of(payload)};
    std::string record(reinterpret_cast<const char*>(&header), sizeof header);
    record += payload;
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
