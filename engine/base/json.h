#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/base/error.h"

namespace palpate {

// A JSON value with its line in the text, so that error messages about its meaning can name the
// line. Values made by the program have line 0 and are written as literals:
//     Json report{{"size", {64, 64, 40}}, {"modality", "CT"}};
//     report["warnings"] = warnings;
// A braced list whose entries all are pairs of a text and a value is an object, another is an
// array.
struct Json {
    enum class Kind { null, boolean, number, string, array, object };
    Kind kind = Kind::null;
    int line = 0; // of the value's first character; the first line is 1
    bool boolean = false;
    double number = 0.0; // whole numbers are exact up to 2^53
    std::string string;
    std::vector<Json> items;                           // of an array
    std::vector<std::pair<std::string, Json>> members; // of an object, in the order of the text

    Json() = default;
    Json(std::nullptr_t) {}
    template <class T>
    requires std::is_arithmetic_v<T> Json(T value)
        : kind(Kind::number), number(static_cast<double>(value)) {}
    Json(bool value) : kind(Kind::boolean), boolean(value) {}
    Json(std::string value) : kind(Kind::string), string(std::move(value)) {}
    Json(std::string_view value) : Json(std::string(value)) {}
    Json(const char* value) : Json(std::string(value)) {}
    template <class T>
    Json(const std::vector<T>& values) : kind(Kind::array), items(values.begin(), values.end()) {}
    Json(const glm::dvec3& value) : Json{value.x, value.y, value.z} {}
    Json(std::initializer_list<Json> entries);

    static Json array(std::initializer_list<Json> items = {});
    static Json object();

    const Json* find(std::string_view key) const; // null where there is no such member
    // The member of an object, which is made where there is none; null becomes an object.
    Json& operator[](std::string_view key);
    // The member of an object, or null.
    const Json& operator[](std::string_view key) const;
    // The items of an array; null becomes an array.
    void push_back(Json item);
    // Sets the members of `other`.
    void update(Json other);

    bool is_null() const { return kind == Kind::null; }
    bool contains(std::string_view key) const { return find(key) != nullptr; }
    std::vector<double> numbers() const; // of an array of numbers
    auto begin() const { return items.begin(); }
    auto end() const { return items.end(); }

    // The same value, whatever the line.
    friend bool operator==(const Json& a, const Json& b);
};

// "a number", "a text", "an object", ... for messages.
const char* kind_name(Json::Kind kind);

// `name` is the file's, for messages. Refused: text that is not JSON (RFC 8259), a duplicate key in
// an object, nesting deeper than 64, numbers that overflow a double. first_line: where in the file
// the text begins.
Result<Json> parse_json(std::string_view text, const std::string& name, int first_line = 1);

// Readable text with two spaces per level and a final line break; arrays of plain values stay on
// one line. Numbers take the fewest digits that give the same double back; NaN and infinities
// become null.
std::string json_text(const Json& value);

// The same on one line, without a line break.
std::string json_line(const Json& value);

} // namespace palpate
