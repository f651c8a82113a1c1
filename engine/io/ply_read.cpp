#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "engine/io/decoder.h"
#include "engine/io/mesh_formats.h"

namespace palpate::io {

namespace {

using Type = ComponentType;

constexpr TypeKey<std::string_view> kTypes[] = {
    {"char", Type::i8},   {"int8", Type::i8},     {"uchar", Type::u8},   {"uint8", Type::u8},
    {"short", Type::i16}, {"int16", Type::i16},   {"ushort", Type::u16}, {"uint16", Type::u16},
    {"int", Type::i32},   {"int32", Type::i32},   {"uint", Type::u32},   {"uint32", Type::u32},
    {"float", Type::f32}, {"float32", Type::f32}, {"double", Type::f64}, {"float64", Type::f64}};

struct Property {
    std::string name;
    Type type{};
    std::optional<Type> count_type; // of a list
};

struct Element {
    std::string name;
    uint64_t count = 0;
    std::vector<Property> properties;

    const Property* find(std::string_view key) const {
        const auto at = std::find_if(properties.begin(), properties.end(),
                                     [&](const Property& p) { return p.name == key; });
        return at == properties.end() ? nullptr : &*at;
    }
};

struct Header {
    enum class Encoding { ascii, little, big } encoding{};
    std::vector<Element> elements;
    std::string comments;
    std::string_view body;
};

Result<Property> parse_property(Words& words, const std::string& name, int line) {
    Property property;
    std::string_view word = words.next();
    if (word == "list") {
        property.count_type = find_type(kTypes, words.next());
        if (!property.count_type || *property.count_type >= Type::f32)
            return fail("{}:{}: expected a whole-number type for the length of a list", name, line);
        word = words.next();
    }
    const std::optional<Type> type = find_type(kTypes, word);
    if (!type)
        return fail("{}:{}: expected a type such as float or uchar, found \"{}\"", name, line,
                    word.substr(0, std::min<size_t>(40, word.size())));
    property.type = *type;
    property.name = words.next();
    if (property.name.empty())
        return fail("{}:{}: expected the name of a property, found none", name, line);
    return property;
}

Result<Header> parse_header(std::string_view text, const std::string& name) {
    Header header;
    bool has_format = false;
    constexpr size_t kMostLines = 4096;
    for (int line = 1; line <= int(kMostLines); ++line) {
        const size_t end = text.find('\n');
        if (end == std::string_view::npos)
            return fail("{}: expected a line end_header, found the end of the file", name);
        Words words(text.substr(0, end));
        text.remove_prefix(end + 1);
        const std::string_view key = words.next();
        if (key == "comment" || key == "obj_info")
            add_comment(header.comments, words.rest());
        if (key == "ply" || key == "comment" || key == "obj_info" || key.empty())
            continue;
        if (key == "format") {
            const std::string_view format = words.next(), version = words.next();
            if (format == "ascii")
                header.encoding = Header::Encoding::ascii;
            else if (format == "binary_little_endian")
                header.encoding = Header::Encoding::little;
            else if (format == "binary_big_endian")
                header.encoding = Header::Encoding::big;
            else
                return fail(
                    "{}:{}: expected format ascii, binary_little_endian or "
                    "binary_big_endian, found \"{}\"",
                    name, line, format.substr(0, std::min<size_t>(40, format.size())));
            if (version != "1.0")
                return fail("{}:{}: expected version 1.0, found \"{}\"", name, line,
                            version.substr(0, std::min<size_t>(40, version.size())));
            has_format = true;
        } else if (key == "element") {
            Element element;
            element.name = words.next();
            const std::optional<double> count = words.number();
            if (!count || *count < 0 || *count > 4294967295.0 || *count != std::floor(*count))
                return fail("{}:{}: expected a number of elements 0 .. 4294967295, found {}", name,
                            line, words.quoted());
            element.count = static_cast<uint64_t>(*count);
            header.elements.push_back(std::move(element));
        } else if (key == "property") {
            if (header.elements.empty())
                return fail("{}:{}: expected an element before its properties, found none", name,
                            line);
            PALPATE_TRY(Property property, parse_property(words, name, line));
            header.elements.back().properties.push_back(std::move(property));
        } else if (key == "end_header") {
            if (!has_format)
                return fail("{}: expected a line \"format\", found none", name);
            header.body = text;
            return header;
        } else {
            return fail("{}:{}: expected element, property or end_header, found \"{}\"", name, line,
                        key.substr(0, std::min<size_t>(40, key.size())));
        }
    }
    return fail("{}: expected a header of at most {} lines, found more", name, kMostLines);
}

// Numbers of the body one after another, as doubles, whatever they are written as.
class Numbers {
 public:
    Numbers(const Header& header)
        : words_(header.body), bytes_(header.body), encoding_(header.encoding) {}

    std::optional<double> next(Type type) {
        if (encoding_ == Header::Encoding::ascii)
            return words_.number();
        const size_t size = bytes_per_component(type);
        if (bytes_.size() < size)
            return {};
        std::array<char, 8> word{};
        std::memcpy(word.data(), bytes_.data(), size);
        bytes_.remove_prefix(size);
        if (encoding_ == Header::Encoding::big)
            std::reverse(word.begin(), word.begin() + static_cast<std::ptrdiff_t>(size));
        return visit_component(type, [&](auto value) {
            std::memcpy(&value, word.data(), sizeof value);
            return static_cast<double>(value);
        });
    }
    // The fewest bytes that a number takes: of text, a digit and a space.
    uint64_t least_bytes(Type type) const {
        return encoding_ == Header::Encoding::ascii ? 2 : bytes_per_component(type);
    }
    // Bytes of the body not yet taken.
    uint64_t rest() const {
        return encoding_ == Header::Encoding::ascii ? words_.rest().size() : bytes_.size();
    }
    bool only_white_is_left() {
        return encoding_ == Header::Encoding::ascii ? Words(words_.rest()).next().empty()
                                                    : bytes_.empty();
    }
    std::string found() const {
        return encoding_ == Header::Encoding::ascii ? words_.quoted() : "the end of the file";
    }

 private:
    Words words_;
    std::string_view bytes_;
    Header::Encoding encoding_;
};

// The fewest bytes that the elements can take.
uint64_t least_bytes(const Element& element, Header::Encoding encoding) {
    uint64_t each = 0;
    for (const Property& property : element.properties)
        each += encoding == Header::Encoding::ascii
                    ? 2
                    : bytes_per_component(property.count_type.value_or(property.type));
    const uint64_t all = each * element.count; // below 2^32 * 4096 * 8
    return encoding == Header::Encoding::ascii && all > 0 ? all - 1 : all;
}

class Body {
 public:
    Body(const Header& header, const std::string& name, uint64_t limit_bytes)
        : header_(header), numbers_(header), name_(name), limit_bytes_(limit_bytes) {}

    Result<LoadedMesh> parse() {
        for (const Element& element : header_.elements) {
            const uint64_t least = least_bytes(element, header_.encoding);
            if (least > numbers_.rest())
                return fail("{}: expected {} of element {}, at least {} bytes, found {}", name_,
                            element.count, element.name, least, numbers_.rest());
            // Elements without properties take no bytes: as many as there may be say nothing.
            const uint64_t count = element.properties.empty() ? 0 : element.count;
            PALPATE_TRY(prepare(element));
            for (uint64_t n = 0; n < count; ++n)
                PALPATE_TRY(read_one(element, n));
        }
        return finish();
    }

 private:
    // Takes memory from the limit before it is taken from the machine.
    Result<void> spend(uint64_t bytes) {
        if (bytes > limit_bytes_ - spent_bytes_)
            return fail(
                "{}: expected a mesh of at most {} bytes, as memory allows, found a larger one",
                name_, limit_bytes_);
        spent_bytes_ += bytes;
        return {};
    }

    // Room for more triangles and their labels. It grows by half, and what it grows from is freed.
    Result<void> reserve_triangles(uint64_t more) {
        Mesh& mesh = loaded_.mesh;
        const uint64_t wanted = mesh.triangles.size() + more, before = mesh.triangles.capacity();
        if (wanted <= before)
            return {};
        const uint64_t each = sizeof(glm::uvec3) + (has_labels_ ? sizeof(uint16_t) : 0) +
                              (has_outer_labels_ ? sizeof(uint16_t) : 0);
        const uint64_t room = std::max(wanted, before + before / 2);
        PALPATE_TRY(spend(room * each));
        mesh.triangles.reserve(room);
        mesh.labels.reserve(has_labels_ ? room : 0);
        mesh.outer_labels.reserve(has_outer_labels_ ? room : 0);
        spent_bytes_ -= before * each;
        return {};
    }

    Result<void> prepare(const Element& element) {
        if (element.name == "vertex") {
            if (vertices_)
                return fail("{}: expected one element vertex, found two", name_);
            for (const char* axis : {"x", "y", "z"})
                if (const Property* p = element.find(axis); !p || p->count_type)
                    return fail("{}: expected vertices with a number {}, found none", name_, axis);
            has_normals_ = element.find("nx") && element.find("ny") && element.find("nz");
            // Here in double, and then in float.
            PALPATE_TRY(spend(element.count * (sizeof(glm::dvec3) + sizeof(glm::vec3) +
                                               (has_normals_ ? sizeof(glm::vec3) : 0))));
            points_.reserve(element.count);
            loaded_.mesh.normals.reserve(has_normals_ ? element.count : 0);
            vertices_ = element.count;
        }
        if (element.name == "face") {
            if (has_faces_)
                return fail("{}: expected one element face, found two", name_);
            has_faces_ = true;
            if (!vertices_)
                return fail("{}: expected vertices before faces, found none", name_);
            const Property* list = element.find("vertex_indices");
            list = list ? list : element.find("vertex_index");
            if (!list || !list->count_type)
                return fail("{}: expected faces with a list vertex_indices, found none", name_);
            has_labels_ = element.find("label") != nullptr;
            has_outer_labels_ = has_labels_ && element.find("outer_label") != nullptr;
            return reserve_triangles(element.count);
        }
        return {};
    }

    tl::unexpected<Error> ended(const Element& element, uint64_t n, const Property& property) {
        return fail("{}: expected a number for {} of {} {}, found {}", name_, property.name,
                    element.name, n, numbers_.found());
    }

    Result<void> read_one(const Element& element, uint64_t n) {
        glm::dvec3 point(0.0), normal(0.0);
        const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
        size_t first_triangle = loaded_.mesh.triangles.size();
        double label = 0.0, outer_label = 0.0;
        for (const Property& property : element.properties) {
            if (property.count_type) {
                const bool is_corners = is_face && property.name.starts_with("vertex_ind");
                PALPATE_TRY(read_list(element, n, property, is_corners));
                continue;
            }
            const std::optional<double> value = numbers_.next(property.type);
            if (!value)
                return ended(element, n, property);
            if (is_vertex && property.name.size() == 1 && property.name[0] >= 'x' &&
                property.name[0] <= 'z') {
                if (!std::isfinite(*value) || std::abs(*value) > 1e12)
                    return fail("{}: expected positions within 1e12 mm, found {} = {} at vertex {}",
                                name_, property.name, *value, n);
                point[property.name[0] - 'x'] = *value;
            } else if (is_vertex && has_normals_ && property.name.size() == 2 &&
                       property.name[0] == 'n' && property.name[1] >= 'x' &&
                       property.name[1] <= 'z') {
                normal[property.name[1] - 'x'] = *value;
            } else if (is_face && (property.name == "label" || property.name == "outer_label")) {
                if (!(*value >= 0.0 && *value <= 65535.0) || *value != std::floor(*value))
                    return fail("{}: expected labels 0 .. 65535, found {} = {} at face {}", name_,
                                property.name, *value, n);
                (property.name == "label" ? label : outer_label) = *value;
            }
        }
        if (is_vertex) {
            points_.push_back(point);
            if (has_normals_)
                loaded_.mesh.normals.push_back(unit_normal(normal));
        }
        if (is_face)
            for (; first_triangle < loaded_.mesh.triangles.size(); ++first_triangle) {
                if (has_labels_)
                    loaded_.mesh.labels.push_back(static_cast<uint16_t>(label));
                if (has_outer_labels_)
                    loaded_.mesh.outer_labels.push_back(static_cast<uint16_t>(outer_label));
            }
        return {};
    }

    Result<void> read_list(const Element& element, uint64_t n, const Property& property,
                           bool is_corners) {
        const std::optional<double> count = numbers_.next(*property.count_type);
        if (!count)
            return ended(element, n, property);
        if (*count < (is_corners ? 3.0 : 0.0) || *count != std::floor(*count))
            return fail("{}: expected {} entries in {} of {} {}, found {}", name_,
                        is_corners ? "3 or more" : "0 or more", property.name, element.name, n,
                        *count);
        const auto entries = static_cast<uint64_t>(*count);
        const uint64_t least = entries * numbers_.least_bytes(property.type);
        if (least > numbers_.rest() + 1) // the last of a text has nothing behind it
            return fail("{}: expected {} entries in {} of {} {}, at least {} bytes, found {}",
                        name_, entries, property.name, element.name, n, least, numbers_.rest());
        if (is_corners)
            PALPATE_TRY(reserve_triangles(entries - 2));
        std::array<uint32_t, 2> fan{}; // the first corner and the last
        for (uint64_t i = 0; i < entries; ++i) {
            const std::optional<double> value = numbers_.next(property.type);
            if (!value)
                return ended(element, n, property);
            if (!is_corners)
                continue;
            if (!(*value >= 0.0 && *value < double(*vertices_)) || *value != std::floor(*value))
                return fail("{}: expected vertices 0 .. {} in face {}, found {}", name_,
                            int64_t(*vertices_) - 1, n, *value);
            const auto corner = static_cast<uint32_t>(*value);
            if (i >= 2)
                loaded_.mesh.triangles.emplace_back(fan[0], fan[1], corner);
            fan[i == 0 ? 0 : 1] = corner;
        }
        return {};
    }

    Result<LoadedMesh> finish() {
        if (!vertices_)
            return fail("{}: expected an element vertex, found none", name_);
        if (!numbers_.only_white_is_left())
            loaded_.warnings.push_back(
                fmt::format("{}: {} bytes follow the last element", name_, numbers_.rest()));
        PALPATE_TRY(place_in_world(loaded_, points_, header_.comments, name_));
        return std::move(loaded_);
    }

    const Header& header_;
    Numbers numbers_;
    const std::string& name_;
    LoadedMesh loaded_;
    std::vector<glm::dvec3> points_;
    std::optional<uint64_t> vertices_; // how many the header claims
    bool has_normals_ = false, has_labels_ = false, has_outer_labels_ = false, has_faces_ = false;
    uint64_t limit_bytes_, spent_bytes_ = 0;
};

} // namespace

Result<LoadedMesh> parse_ply(std::string_view text, const std::string& name, uint64_t limit_bytes) {
    PALPATE_TRY(const Header header, parse_header(text, name));
    return Body(header, name, limit_bytes).parse();
}

} // namespace palpate::io
