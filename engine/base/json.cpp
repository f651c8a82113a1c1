#include "engine/base/json.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "engine/base/assert.h"

namespace palpate {

namespace {

constexpr size_t kMaxDepth = 64;

// Walks a text and counts the lines it has left behind. The parser reads at most one character
// beyond a token; that one is not counted, as it may be the line break that ends the token.
struct LineCounter {
    int line = 1;
    bool pending = false; // the character read last is a line break
    void read(char c) {
        line += pending ? 1 : 0;
        pending = c == '\n';
    }
};

class CountingIterator {
 public:
    using iterator_category = std::input_iterator_tag;
    using value_type = char;
    using difference_type = std::ptrdiff_t;
    using pointer = const char*;
    using reference = const char&;

    CountingIterator(const char* at, LineCounter* lines) : at_(at), lines_(lines) {}
    reference operator*() const { return *at_; }
    CountingIterator& operator++() {
        lines_->read(*at_++);
        return *this;
    }
    CountingIterator operator++(int) {
        CountingIterator before = *this;
        ++*this;
        return before;
    }
    friend bool operator==(const CountingIterator& a, const CountingIterator& b) {
        return a.at_ == b.at_;
    }

 private:
    const char* at_;
    LineCounter* lines_;
};

// Builds the tree from the parser's events. Open containers are kept by value on a stack and moved
// into their parents when they close, so that no pointer into a growing vector is held.
class TreeBuilder : public nlohmann::json_sax<nlohmann::json> {
 public:
    explicit TreeBuilder(const LineCounter& lines) : lines_(lines) {}

    Json root;
    std::string problem; // why parsing stopped
    int problem_line = 0;

    bool null() override { return put({}); }
    bool boolean(bool value) override { return put(value); }
    bool number_integer(number_integer_t value) override { return put(value); }
    bool number_unsigned(number_unsigned_t value) override { return put(value); }
    bool number_float(number_float_t value, const string_t&) override { return put(value); }
    bool string(string_t& value) override { return put(value); }
    bool binary(binary_t&) override { return stop("binary data has no place in JSON"); }
    bool start_object(std::size_t) override { return open(Json::object()); }
    bool start_array(std::size_t) override { return open(Json::array()); }
    bool end_object() override { return close(); }
    bool end_array() override { return close(); }
    bool key(string_t& name) override {
        if (open_.back().find(name) != nullptr)
            return stop(fmt::format("the key \"{}\" appears twice", name));
        open_.back().members.emplace_back(name, Json{});
        return true;
    }
    bool parse_error(std::size_t, const std::string& last_token,
                     const nlohmann::detail::exception& error) override {
        // "[json.exception...] parse error at line 3, column 5: the part that helps; last read ..."
        const std::string_view what = error.what();
        const size_t colon = what.find(": ");
        std::string_view reason = what.substr(colon == what.npos ? 0 : colon + 2);
        reason = reason.substr(0, reason.find("; last read"));
        const std::string token(last_token.substr(0, 40));
        return stop(
            fmt::format("{}{}", reason, token.empty() ? "" : fmt::format(" near \"{}\"", token)));
    }

 private:
    bool stop(std::string why) {
        problem = std::move(why);
        problem_line = lines_.line;
        return false;
    }
    bool put(Json value) {
        if (value.line == 0)
            value.line = lines_.line;
        if (open_.empty())
            root = std::move(value);
        else if (open_.back().kind == Json::Kind::array)
            open_.back().items.push_back(std::move(value));
        else
            open_.back().members.back().second = std::move(value);
        return true;
    }
    bool open(Json container) {
        if (open_.size() == kMaxDepth)
            return stop(
                fmt::format("expected at most {} levels of nesting, found more", kMaxDepth));
        container.line = lines_.line;
        open_.push_back(std::move(container));
        return true;
    }
    bool close() {
        Json value = std::move(open_.back());
        open_.pop_back();
        return put(std::move(value));
    }

    const LineCounter& lines_;
    std::vector<Json> open_;
};

bool is_plain(const Json& value) {
    return value.kind != Json::Kind::array && value.kind != Json::Kind::object;
}

std::string quoted(const std::string& text) {
    return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void write(const Json& value, const std::string& indent, std::string& out) {
    const std::string inner = indent + "  ";
    switch (value.kind) {
        case Json::Kind::null:
            out += "null";
            return;
        case Json::Kind::boolean:
            out += value.boolean ? "true" : "false";
            return;
        case Json::Kind::number:
            out += std::isfinite(value.number) ? fmt::format("{}", value.number) : "null";
            return;
        case Json::Kind::string:
            out += quoted(value.string);
            return;
        case Json::Kind::array: {
            const bool one_line = std::all_of(value.items.begin(), value.items.end(), is_plain);
            out += '[';
            for (size_t i = 0; i < value.items.size(); ++i) {
                out += i == 0 ? "" : one_line ? ", " : ",";
                if (!one_line)
                    out += "\n" + inner;
                write(value.items[i], inner, out);
            }
            out += one_line ? "]" : "\n" + indent + "]";
            return;
        }
        case Json::Kind::object:
            out += '{';
            for (size_t i = 0; i < value.members.size(); ++i) {
                out += (i == 0 ? "\n" : ",\n") + inner + quoted(value.members[i].first) + ": ";
                write(value.members[i].second, inner, out);
            }
            out += value.members.empty() ? "}" : "\n" + indent + "}";
            return;
    }
}

} // namespace

Json::Json(std::initializer_list<Json> entries) {
    const auto is_member = [](const Json& entry) {
        return entry.kind == Kind::array && entry.items.size() == 2 &&
               entry.items[0].kind == Kind::string;
    };
    if (!std::all_of(entries.begin(), entries.end(), is_member)) {
        *this = array(entries);
        return;
    }
    kind = Kind::object;
    for (const Json& entry : entries)
        members.emplace_back(entry.items[0].string, entry.items[1]);
}

Json Json::array(std::initializer_list<Json> items) {
    Json json;
    json.kind = Kind::array;
    json.items = items;
    return json;
}

Json Json::object() {
    Json json;
    json.kind = Kind::object;
    return json;
}

Json& Json::operator[](std::string_view key) {
    if (is_null())
        *this = object();
    PALPATE_ASSERT(kind == Kind::object);
    for (auto& [name, value] : members)
        if (name == key)
            return value;
    return members.emplace_back(key, Json{}).second;
}

const Json& Json::operator[](std::string_view key) const {
    static const Json none;
    const Json* member = find(key);
    return member != nullptr ? *member : none;
}

void Json::push_back(Json item) {
    if (is_null())
        kind = Kind::array;
    PALPATE_ASSERT(kind == Kind::array);
    items.push_back(std::move(item));
}

void Json::update(Json other) {
    for (auto& [name, value] : other.members)
        (*this)[name] = std::move(value);
}

const Json* Json::find(std::string_view key) const {
    for (const auto& [name, value] : members)
        if (name == key)
            return &value;
    return nullptr;
}

std::vector<double> Json::numbers() const {
    std::vector<double> all;
    for (const Json& item : items)
        all.push_back(item.number);
    return all;
}

bool operator==(const Json& a, const Json& b) {
    return a.kind == b.kind && a.boolean == b.boolean && a.number == b.number &&
           a.string == b.string && a.items == b.items && a.members == b.members;
}

const char* kind_name(Json::Kind kind) {
    constexpr const char* names[] = {"null",   "true or false", "a number",
                                     "a text", "a list",        "an object"};
    return names[static_cast<size_t>(kind)];
}

Result<Json> parse_json(std::string_view text, const std::string& name, int first_line) {
    LineCounter lines{first_line};
    TreeBuilder builder(lines);
    const CountingIterator first(text.data(), &lines);
    const CountingIterator last(text.data() + text.size(), &lines);
    if (!nlohmann::json::sax_parse(first, last, &builder))
        return fail("{}:{}: not readable as JSON: {}", name, builder.problem_line, builder.problem);
    return std::move(builder.root);
}

std::string json_line(const Json& value) {
    const auto listed = [](char open, char close, const auto& all, const auto& one) {
        std::string out(1, open);
        for (size_t i = 0; i < all.size(); ++i)
            out += (i == 0 ? "" : ", ") + one(all[i]);
        return out + close;
    };
    if (value.kind == Json::Kind::array)
        return listed('[', ']', value.items, json_line);
    if (value.kind == Json::Kind::object)
        return listed('{', '}', value.members, [](const auto& member) {
            return quoted(member.first) + ": " + json_line(member.second);
        });
    std::string out;
    write(value, "", out);
    return out;
}

std::string json_text(const Json& value) {
    std::string out;
    write(value, "", out);
    return out + "\n";
}

} // namespace palpate
