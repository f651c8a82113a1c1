#include "engine/edit/journal_records.h"

#include <fmt/format.h>
#include <zlib.h>

#include <cstring>

namespace palpate {

namespace {

struct RecordHeader {
    uint32_t bytes, crc;
};

uint32_t crc_of(std::string_view bytes) {
    return static_cast<uint32_t>(
        ::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::optional<RecordHeader> header_at(std::string_view file, size_t at) {
    RecordHeader header;
    if (file.size() - at < sizeof header)
        return std::nullopt;
    std::memcpy(&header, file.data() + at, sizeof header);
    return header;
}

// Whether bytes at `at` may be a record: only what begins and ends as payloads do is worth its CRC.
bool looks_like_record(std::string_view file, size_t at) {
    const std::optional<RecordHeader> header = header_at(file, at);
    if (!header || header->bytes == 0 || file.size() - at - sizeof *header < header->bytes)
        return false;
    const std::string_view payload = file.substr(at + sizeof *header, header->bytes);
    return payload.back() == '\n' && (payload.starts_with("{\"") || payload.starts_with("undo") ||
                                      payload.starts_with("redo"));
}

} // namespace

// No header lies within text, whose lengths would have no zeros, and hardly one within a packed
// difference, which would need its CRC-32, too.
size_t count_steps(std::string_view file, size_t at) {
    size_t count = 0;
    while (at + sizeof(RecordHeader) < file.size()) {
        const auto payload = looks_like_record(file, at) ? next_record(file, at) : std::nullopt;
        if (!payload)
            ++at;
        else if (!payload->starts_with("{\"volumes\"") && !payload->starts_with("{\"save\""))
            ++count; // and not the first record, which says what the others belong to
    }
    return count;
}

std::string record_of(std::string_view payload) {
    const RecordHeader header{static_cast<uint32_t>(payload.size()), crc_of(payload)};
    std::string record(reinterpret_cast<const char*>(&header), sizeof header);
    return record.append(payload);
}

std::optional<std::string_view> next_record(std::string_view file, size_t& at) {
    const std::optional<RecordHeader> header = header_at(file, at);
    if (!header || header->bytes == 0 || file.size() - at - sizeof *header < header->bytes)
        return std::nullopt;
    const std::string_view payload = file.substr(at + sizeof *header, header->bytes);
    if (crc_of(payload) != header->crc)
        return std::nullopt;
    at += sizeof *header + header->bytes;
    return payload;
}

JournalTail tail_of(std::string_view file, size_t at) {
    using Kind = JournalTail::Kind;
    if (at >= file.size())
        return {};
    const size_t later = count_steps(file, at);
    const std::optional<RecordHeader> header = header_at(file, at);
    if (!header || (later == 0 && file.back() == '\0'))
        return {Kind::unfinished, {}, 0};
    const std::string_view rest = file.substr(at + sizeof *header);
    const bool fits = header->bytes > 0 && header->bytes <= rest.size();
    if (header->bytes > 0 && !fits && later == 0 && crc_of(rest) != header->crc)
        return {Kind::unfinished, {}, 0};
    if (!fits)
        return {
            Kind::damaged,
            fmt::format("expected a length of 1 to {} bytes, found {}", rest.size(), header->bytes),
            later};
    return {Kind::damaged,
            fmt::format("expected checksum {:08x}, found {:08x}", header->crc,
                        crc_of(rest.substr(0, header->bytes))),
            later};
}

} // namespace palpate
