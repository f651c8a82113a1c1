#include "engine/decode/tiff_file.h"

#include "engine/io/decoder.h"

namespace palpate::io {

namespace {

constexpr uint64_t kMostValues = 1 << 22;
constexpr uint64_t kMostTextBytes = 64 << 20;
constexpr uint64_t kMostTags = 1 << 16;

// Bytes of one value by its type; 0 where there is no such type.
uint32_t bytes_of_type(uint32_t type) {
    constexpr uint32_t bytes[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};
    return type < std::size(bytes) ? bytes[type] : 0;
}

} // namespace

Result<FileParts> FileParts::open(const std::filesystem::path& path) {
    PALPATE_TRY(const uint64_t bytes, regular_file_bytes(path));
    return FileParts(path, bytes);
}

Result<std::string> FileParts::take(uint64_t at, uint64_t count, const std::string& what) {
    if (at > bytes_ || count > bytes_ - at)
        return fail("{}: expected {} in bytes {} to {}, found the end of the file at byte {}",
                    name_, what, at, at + count, bytes_);
    std::string out(count, '\0');
    in_.seekg(static_cast<std::streamoff>(at));
    in_.read(out.data(), static_cast<std::streamsize>(count));
    if (!in_)
        return fail("{}: cannot be read at byte {}", name_, at);
    return out;
}

uint64_t FileParts::number(std::string_view bytes, size_t at, size_t count) const {
    uint64_t value = 0;
    for (size_t i = 0; i < count; ++i)
        value =
            value << 8 | static_cast<unsigned char>(bytes[at + (big_endian ? i : count - 1 - i)]);
    return value;
}

Result<TiffFile> TiffFile::open(const std::filesystem::path& path) {
    PALPATE_TRY(FileParts parts, FileParts::open(path));
    TiffFile file(std::move(parts));
    PALPATE_TRY(std::string head, file.parts_.take(0, 8, "the header of a TIFF"));
    file.parts_.big_endian = head.starts_with("MM");
    const uint64_t version = file.parts_.number(head, 2, 2);
    if ((!file.is_big_endian() && !head.starts_with("II")) || (version != 42 && version != 43))
        return fail("{}: expected a TIFF that begins with II or MM and 42, found other bytes",
                    path.string());
    file.is_big_ = version == 43;
    if (file.is_big_) {
        PALPATE_TRY(head, file.parts_.take(0, 16, "the header of a BigTIFF"));
    }
    file.first_ = file.is_big_ ? file.parts_.number(head, 8, 8) : file.parts_.number(head, 4, 4);
    return file;
}

Result<TiffDirectory> TiffFile::directory(uint64_t at) {
    const size_t word = is_big_ ? 8 : 4, entry_bytes = is_big_ ? 20 : 12;
    const size_t count_bytes = is_big_ ? 8 : 2;
    PALPATE_TRY(const std::string count, parts_.take(at, count_bytes, "the number of tags"));
    const uint64_t entries = parts_.number(count, 0, count_bytes);
    if (entries > kMostTags)
        return fail("{}: expected at most {} tags, found {}", name(), kMostTags, entries);
    const uint64_t begin = at + count_bytes;
    PALPATE_TRY(const std::string bytes,
                parts_.take(begin, entry_bytes * entries + word, "the tags"));
    TiffDirectory directory;
    for (uint64_t i = 0; i < entries; ++i) {
        const size_t here = entry_bytes * i;
        const auto tag = static_cast<uint32_t>(parts_.number(bytes, here, 2));
        TiffDirectory::Entry entry;
        entry.type = static_cast<uint32_t>(parts_.number(bytes, here + 2, 2));
        entry.count = parts_.number(bytes, here + 4, word);
        const uint64_t each = bytes_of_type(entry.type);
        // Values that fit lie in the tag itself.
        entry.at = each == 0 || entry.count <= word / each
                       ? begin + here + 4 + word
                       : parts_.number(bytes, here + 4 + word, word);
        const uint64_t most = this->bytes() - std::min(entry.at, this->bytes());
        if (each > 0 && entry.count > most / each)
            return fail(
                "{}: expected the values of tag {} in bytes {} to {}, found the end of the "
                "file at byte {}",
                name(), tag, entry.at, entry.at + each * std::min(entry.count, UINT64_MAX >> 16),
                this->bytes());
        directory.tags.emplace(tag, entry);
    }
    directory.next = parts_.number(bytes, entry_bytes * entries, word);
    return directory;
}

Result<std::vector<uint64_t>> TiffFile::numbers(const TiffDirectory& directory, uint32_t tag,
                                                const char* what) {
    const auto found = directory.tags.find(tag);
    std::vector<uint64_t> values;
    if (found == directory.tags.end())
        return values;
    const TiffDirectory::Entry& entry = found->second;
    if ((entry.type != 1 && entry.type != 3 && entry.type != 4 && entry.type != 16) ||
        entry.count == 0 || entry.count > kMostValues)
        return fail("{}: expected whole numbers as {} (tag {}), found {} of type {}", name(), what,
                    tag, entry.count, entry.type);
    const uint32_t each = bytes_of_type(entry.type);
    PALPATE_TRY(const std::string bytes, parts_.take(entry.at, each * entry.count, what));
    for (uint64_t i = 0; i < entry.count; ++i)
        values.push_back(parts_.number(bytes, i * each, each));
    return values;
}

Result<std::string> TiffFile::text(const TiffDirectory& directory, uint32_t tag, const char* what) {
    const auto found = directory.tags.find(tag);
    if (found == directory.tags.end() || bytes_of_type(found->second.type) != 1)
        return std::string();
    if (found->second.count > kMostTextBytes)
        return fail("{}: expected at most {} bytes as {} (tag {}), found {}", name(),
                    kMostTextBytes, what, tag, found->second.count);
    PALPATE_TRY(std::string bytes, parts_.take(found->second.at, found->second.count, what));
    bytes.resize(std::min(bytes.size(), bytes.find('\0')));
    return bytes;
}

Result<std::optional<double>> TiffFile::rational(const TiffDirectory& directory, uint32_t tag,
                                                 const char* what) {
    const auto found = directory.tags.find(tag);
    if (found == directory.tags.end() || found->second.type != 5 || found->second.count == 0)
        return std::optional<double>();
    PALPATE_TRY(const std::string bytes, parts_.take(found->second.at, 8, what));
    const uint64_t above = parts_.number(bytes, 0, 4), below = parts_.number(bytes, 4, 4);
    if (above == 0 || below == 0)
        return std::optional<double>();
    return std::optional(static_cast<double>(above) / static_cast<double>(below));
}

} // namespace palpate::io
