#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/error.h"

namespace palpate {

// A JSON value with its line in the text, so that error messages about its meaning can name the
// line. Values made by the program have line 0.
struct Json {
    enum class Kind { null, boolean, number, string, array, object };
    Kind kind = Kind::null;
    int line = 0; // of the value's first character; the first line is 1
    bool boolean = false;
    double number = 0.0;
    std::string string;
    std::vector<Json> items;                           // of an array
    std::vector<std::pair<std::string, Json>> members; // of an object, in the order of the text

    static Json of(double value);
    static Json of(bool value);
    static Json of(std::string value);
    static Json of(const char* value) { return of(std::string(value)); }
    static Json array(std::vector<Json> items = {});
    static Json object(std::vector<std::pair<std::string, Json>> members = {});

    const Json* find(std::string_view key) const; // null where there is no such member
};

// "a number", "a text", "an object", ... for messages.
const char* kind_name(Json::Kind kind);

// `name` is the file's, for messages. Refused: text that is not JSON (RFC 8259), a duplicate key in
// an object, nesting deeper than 64, numbers that overflow a double. first_line: where in the file
// the text begins.
Result<Json> parse_json(std::string_view text, const std::string& name, int first_line = 1);

// Readable text with two spaces per level and a final line break; arrays of plain values stay on
// one line. Numbers take the fewest digits that give the same double back; they must be finite.
std::string json_text(const Json& value);

// The same on one line, without a line break.
std::string json_line(const Json& value);

} // namespace palpate
