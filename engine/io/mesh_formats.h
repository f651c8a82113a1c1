#pragma once

#include <charconv>
#include <optional>
#include <string>
#include <string_view>

#include "engine/io/mesh_io.h"

// What the readers of meshes share. Texts are whole files; `name` is the file's, for messages.
namespace palpate::io {

// limit_bytes: the most memory to take beside the text.
Result<LoadedMesh> parse_ply(std::string_view text, const std::string& name, uint64_t limit_bytes);
Result<LoadedMesh> parse_stl(std::string_view text, const std::string& name, uint64_t limit_bytes);

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
