#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

// Bodies of several parts, as forms with files have them (RFC 7578 over RFC 2046).
namespace palpate {

struct Part {
    std::string name;     // of the form's field
    std::string filename; // "" where the part is no file
    std::string type;     // content type; "" where the part states none
    std::span<const std::byte> bytes;
};

struct MultipartBody {
    std::string content_type; // with the boundary, which occurs in no part
    std::vector<std::byte> bytes;
};
MultipartBody write_multipart(std::span<const Part> parts);

// The parts of a body, which point into it. Refused, in a sentence: a content type that is not of
// several parts or states no boundary, a body that does not end with it, parts without a name, more
// than 64 parts or 64 lines of a part's header.
Result<std::vector<Part>> read_multipart(std::string_view content_type,
                                         std::span<const std::byte> body);

} // namespace palpate
