#pragma once

#include <glm/glm.hpp>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/json.h"

namespace palpate {

// The first error of a JSON file. Readers continue after it with default values, so that code
// checks once at the end instead of after every value.
struct JsonErrors {
    std::string file; // for messages
    std::optional<Error> first;
};

// A value and its place, such as ray_cast.isos[1].value. An accessor that finds another kind or
// range of value records "FILE:LINE: PLACE: expected ..., found ..." and returns a default.
class JsonValue {
 public:
    // `json` and `errors` must outlive it. `place` is empty for the root.
    JsonValue(const Json& json, std::string place, JsonErrors& errors)
        : json_(&json), place_(std::move(place)), errors_(&errors) {}

    const Json& json() const { return *json_; }
    bool is(Json::Kind kind) const { return json_->kind == kind; }

    // The member of an object; empty where there is none (and where this is no object).
    std::optional<JsonValue> find(std::string_view key) const;
    // The member of an object that must have it: where there is none, an error and null.
    JsonValue at(std::string_view key) const;
    // Reads a member into `out`, which stays as it is where there is none. Whether there is one.
    bool take(std::string_view key, double& out, double low, double high) const;
    bool take(std::string_view key, uint32_t& out, uint32_t low, uint32_t high) const;
    bool take(std::string_view key, bool& out) const;
    bool take(std::string_view key, std::string& out) const;
    // This is an object with no other keys than these; the nearest known key is suggested.
    bool only_keys(const std::vector<std::string_view>& keys) const;

    std::vector<JsonValue> items(size_t least, size_t most) const;
    double number(double low, double high) const;             // low <= value <= high
    double number_above(double low, double high) const;       // low < value <= high
    uint32_t whole_number(uint32_t low, uint32_t high) const; // the same, without a fraction
    bool boolean() const;
    std::string text() const;
    glm::dvec3 vector(double low, double high) const; // a list of three numbers
    glm::dvec3 direction() const;                     // the same, not all 0

    template <class Enum>
    Enum choice(std::initializer_list<std::pair<const char*, Enum>> choices) const {
        std::vector<std::string_view> names;
        for (const auto& [name, value] : choices) {
            if (is(Json::Kind::string) && json_->string == name)
                return value;
            names.push_back(name);
        }
        reject(one_of(names));
        return choices.begin()->second;
    }

    // Records "expected <expected>, found <this value>".
    void reject(const std::string& expected) const;
    // Records a sentence of another shape.
    void complain(const std::string& sentence) const;

 private:
    static std::string one_of(const std::vector<std::string_view>& names);

    const Json* json_;
    std::string place_;
    JsonErrors* errors_;
};

// The entry of `known` with the smallest edit distance to `name`, if it is small enough for a
// typing error (at most a third of its letters); else empty.
std::string_view nearest_name(std::string_view name, const std::vector<std::string_view>& known);

} // namespace palpate
