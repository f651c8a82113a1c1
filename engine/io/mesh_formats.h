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

// Places the positions that a file states, and the normals of loaded.mesh with them, in the world.
// `statement`, the comments of the file, may name the axes as 3D Slicer writes them: with SPACE=RAS
// x and y change their sign, which turns about z and mirrors nothing; SPACE=LPS, or none, leaves
// all as it is, and another space does so with a warning. An error where it names both. Source:
// vtkMRMLModelStorageNode of 3D Slicer.
Result<void> place_in_world(LoadedMesh& loaded, std::vector<glm::dvec3>& positions,
                            std::string_view statement, const std::string& name);

// Adds the beginning of a line to the comments of a file; those of a damaged one may be long.
inline void add_comment(std::string& comments, std::string_view line) {
    constexpr size_t most = 256, most_together = 1 << 16;
    if (comments.size() < most_together)
        comments.append(line.substr(0, most)).append("\n");
}

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
    // The rest of the line.
    std::string_view line() {
        const std::string_view line = rest_.substr(0, rest_.find('\n'));
        rest_.remove_prefix(std::min(rest_.size(), line.size() + 1));
        return line;
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
