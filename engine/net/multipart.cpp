#include "engine/net/multipart.h"

#include <algorithm>
#include <cctype>
#include <optional>

#include "engine/base/printable.h"
#include "engine/net/bytes.h"

namespace palpate {

namespace {

constexpr size_t kMostParts = 64, kMostLines = 64, kMostLetters = 4096;
constexpr size_t kLongestBoundary = 70; // RFC 2046, 5.1.1

std::string lower(std::string_view text) {
    std::string made(text);
    for (char& c : made)
        c = char(std::tolower(static_cast<unsigned char>(c)));
    return made;
}

std::string_view trimmed(std::string_view text) {
    const auto is_space = [](char c) { return c == ' ' || c == '\t'; };
    while (!text.empty() && is_space(text.front()))
        text.remove_prefix(1);
    while (!text.empty() && is_space(text.back()))
        text.remove_suffix(1);
    return text;
}

// The value of a parameter behind the first ';' of a header: name=value or name="value".
std::optional<std::string> parameter_of(std::string_view header, std::string_view name) {
    size_t at = header.find(';');
    while (at < header.size()) {
        const std::string_view rest = header.substr(at + 1);
        const size_t equals = rest.find('=');
        if (equals == std::string_view::npos)
            return std::nullopt;
        const std::string key = lower(trimmed(rest.substr(0, equals)));
        const std::string_view behind = trimmed(rest.substr(equals + 1));
        std::string value;
        size_t used = 0;
        if (!behind.empty() && behind.front() == '"') {
            for (used = 1; used < behind.size() && behind[used] != '"'; ++used) {
                if (behind[used] == '\\' && used + 1 < behind.size())
                    ++used;
                value += behind[used];
            }
        } else {
            used = std::min(behind.find(';'), behind.size());
            value = trimmed(behind.substr(0, used));
        }
        if (key == name)
            return value;
        const size_t next = behind.find(';', used);
        if (next == std::string_view::npos)
            return std::nullopt;
        at = size_t(behind.data() - header.data()) + next;
    }
    return std::nullopt;
}

// The header of a part, up to the empty line; the bytes are what is left.
Result<Part> read_part(std::string_view text) {
    Part part;
    bool has_name = false;
    for (size_t line = 0;; ++line) {
        const size_t end = text.find("\r\n");
        if (end == std::string_view::npos || line == kMostLines || end > kMostLetters)
            return fail("expected a part of a body with a header of at most {} lines, found none",
                        kMostLines);
        const std::string_view header = text.substr(0, end);
        text.remove_prefix(end + 2);
        if (header.empty())
            break;
        const size_t colon = std::min(header.find(':'), header.size());
        const std::string key = lower(trimmed(header.substr(0, colon)));
        const std::string_view value = trimmed(header.substr(std::min(colon + 1, header.size())));
        if (key == "content-type")
            part.type = value;
        if (key != "content-disposition")
            continue;
        if (const auto name = parameter_of(value, "name")) {
            part.name = *name;
            has_name = true;
        }
        part.filename = parameter_of(value, "filename").value_or("");
    }
    if (!has_name)
        return fail("expected a part of a body with a name, found none");
    part.bytes = bytes_of(text);
    return part;
}

// A name between quotes; line breaks and quotes as browsers write them.
std::string in_quotes(std::string_view text) {
    std::string made = "\"";
    for (const char c : text)
        made += c == '"' ? "%22" : c == '\r' ? "%0D" : c == '\n' ? "%0A" : std::string(1, c);
    return made + "\"";
}

std::string boundary_for(std::span<const Part> parts) {
    for (unsigned i = 0;; ++i) {
        std::string boundary = fmt::format("palpate-boundary-{:08x}", i);
        const bool is_free = std::none_of(parts.begin(), parts.end(), [&](const Part& part) {
            return text_of(part.bytes).find(boundary) != std::string_view::npos;
        });
        if (is_free)
            return boundary;
    }
}

} // namespace

MultipartBody write_multipart(std::span<const Part> parts) {
    const std::string boundary = boundary_for(parts);
    MultipartBody body{"multipart/form-data; boundary=" + boundary, {}};
    const auto append = [&](std::span<const std::byte> bytes) {
        body.bytes.insert(body.bytes.end(), bytes.begin(), bytes.end());
    };
    for (const Part& part : parts) {
        std::string header = fmt::format("--{}\r\nContent-Disposition: form-data; name={}",
                                         boundary, in_quotes(part.name));
        if (!part.filename.empty())
            header += "; filename=" + in_quotes(part.filename);
        if (!part.type.empty())
            header += "\r\nContent-Type: " + part.type;
        append(bytes_of(header + "\r\n\r\n"));
        append(part.bytes);
        append(bytes_of("\r\n"));
    }
    append(bytes_of("--" + boundary + "--\r\n"));
    return body;
}

Result<std::vector<Part>> read_multipart(std::string_view content_type,
                                         std::span<const std::byte> body) {
    const std::optional<std::string> boundary = parameter_of(content_type, "boundary");
    if (!lower(trimmed(content_type)).starts_with("multipart/") || !boundary || boundary->empty() ||
        boundary->size() > kLongestBoundary)
        return fail("expected a body of several parts with a boundary, found {}",
                    printable(content_type.substr(0, 200)));
    const std::string mark = "\r\n--" + *boundary;
    std::string_view text = text_of(body);
    // The first mark may stand at the very beginning, without a line break before it.
    size_t at = 0;
    if (text.starts_with(std::string_view(mark).substr(2))) {
        at = mark.size() - 2;
    } else {
        at = text.find(mark);
        if (at == std::string_view::npos)
            return fail("expected the boundary {} in a body, found none", printable(*boundary));
        at += mark.size();
    }
    std::vector<Part> parts;
    while (!text.substr(at).starts_with("--")) {
        const size_t line = text.find("\r\n", at);
        const size_t end = line == std::string_view::npos ? line : text.find(mark, line);
        if (end == std::string_view::npos)
            return fail("expected the boundary {} at the end of a body, found none",
                        printable(*boundary));
        if (parts.size() == kMostParts)
            return fail("expected a body of at most {} parts, found more", kMostParts);
        PALPATE_TRY(Part part, read_part(text.substr(line + 2, end - std::min(end, line + 2))));
        parts.push_back(std::move(part));
        at = end + mark.size();
    }
    return parts;
}

} // namespace palpate
