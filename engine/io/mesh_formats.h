#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "engine/io/mesh_io.h"

// Common functions of mesh readers. Texts are whole files; `name` is the file's, for messages.
namespace palpate::io {

// limit_bytes: the most memory to take beside the text.
Result<LoadedMesh> parse_ply(std::string_view text, const std::string& name, uint64_t limit_bytes);
Result<LoadedMesh> parse_stl(std::string_view text, const std::string& name, uint64_t limit_bytes);
Result<LoadedMesh> parse_obj(std::string_view text, const std::string& name, uint64_t limit_bytes);
Result<LoadedMesh> parse_vtp(std::string_view text, const std::string& name, uint64_t limit_bytes);
Result<LoadedMesh> parse_x3d(std::string_view text, const std::string& name, uint64_t limit_bytes);

// A normal of unit length, and to the bit where it has that but for the rounding of its three
// floats (2^-25 each), so that normals that are written and read stay the same. 0 for 0 and for no
// number.
inline glm::vec3 unit_normal(glm::dvec3 normal) {
    const double length = glm::length(normal);
    if (!std::isfinite(length) || length == 0.0)
        return glm::vec3(0.0f);
    return glm::vec3(std::abs(length - 1.0) <= 0x1p-23 ? normal : normal / length);
}

// Positions as floats about an origin that lies near them.
void set_world_positions(Mesh& mesh, const std::vector<glm::dvec3>& world);

// Takes words off a text that is apart by white space.
class Words {
 public:
    explicit Words(std::string_view text) : rest_(text) {}

    // Empty at the end.
    std::string_view next() {
        const size_t begin = rest_.find_first_not_of(kWhite);
        if (begin == std::string_view::npos) {
            rest_ = {};
            return {};
        }
        const size_t end = std::min(rest_.size(), rest_.find_first_of(kWhite, begin));
        const std::string_view word = rest_.substr(begin, end - begin);
        rest_.remove_prefix(end);
        return word;
    }
    std::optional<double> number() {
        last_ = next();
        std::string_view word = last_;
        if (word.size() > 1 && word.front() == '+')
            word.remove_prefix(1);
        double value = 0.0;
        const auto [stop, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
        if (word.empty() || problem != std::errc{} || stop != word.data() + word.size())
            return {};
        return value;
    }
    void skip_line() {
        const size_t end = rest_.find('\n');
        rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    }
    // The word that number() took last, for messages: "the end" or a quotation.
    std::string quoted() const {
        return last_.empty()
                   ? "the end of the file"
                   : fmt::format("\"{}\"", last_.substr(0, std::min<size_t>(40, last_.size())));
    }
    std::string_view rest() const { return rest_; }

 private:
    static constexpr std::string_view kWhite{" \t\r\n\v\f"};
    std::string_view rest_, last_;
};

} // namespace palpate::io
