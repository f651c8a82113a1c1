#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "engine/io/mesh_formats.h"

// Wavefront OBJ: polygons. Source: "Object Files (.obj)", appendix B1 of the Advanced Visualizer
// manual.
namespace palpate::io {

namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

// The words of logical lines: a backslash before the line's end joins the next one, and # begins a
// comment.
class ObjLines {
 public:
    explicit ObjLines(std::string_view text) : rest_(text) {}

    // Goes to the next line; false at the end.
    bool next_line() {
        while (!word().empty()) {
        }
        if (rest_.empty())
            return false;
        rest_.remove_prefix(1); // the line break
        ++line_;
        return true;
    }
    // Empty at the end of the line.
    std::string_view word() {
        for (;;) {
            const size_t start = std::min(rest_.size(), rest_.find_first_not_of(" \t\r\v\f"));
            rest_.remove_prefix(start);
            if (rest_.starts_with("\\\n") || rest_.starts_with("\\\r\n")) {
                rest_.remove_prefix(rest_[1] == '\n' ? 2 : 3);
                ++line_;
            } else if (rest_.starts_with('#')) {
                rest_.remove_prefix(std::min(rest_.size(), rest_.find('\n')));
            } else {
                break;
            }
        }
        const std::string_view found = rest_.substr(0, rest_.find_first_of(" \t\r\n\v\f#"));
        rest_.remove_prefix(found.size());
        return found;
    }
    uint64_t line() const { return line_; } // the first is 1

 private:
    std::string_view rest_;
    uint64_t line_ = 1;
};

std::string shown(std::string_view word) {
    return word.empty() ? "the end of the line" : fmt::format("\"{}\"", word.substr(0, 40));
}

std::optional<int64_t> whole(std::string_view text) {
    int64_t value = 0;
    const auto [stop, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || problem != std::errc{} || stop != text.data() + text.size())
        return {};
    return value;
}

// How much there is of each, before memory is taken for it.
struct Counts {
    uint64_t points = 0, normals = 0, triangles = 0;
};

Counts count(std::string_view text) {
    Counts counts;
    ObjLines lines(text);
    do {
        const std::string_view key = lines.word();
        counts.points += key == "v";
        counts.normals += key == "vn";
        if (key != "f" && key != "fo")
            continue;
        uint64_t corners = 0;
        while (!lines.word().empty())
            ++corners;
        counts.triangles += corners - std::min<uint64_t>(corners, 2);
    } while (lines.next_line());
    return counts;
}

// The comments before the first vertex.
std::string first_comments(std::string_view text) {
    std::string comments;
    while (!text.empty() && !text.starts_with("v ") && !text.starts_with("v\t")) {
        const std::string_view line = text.substr(0, text.find('\n'));
        if (line.starts_with('#'))
            add_comment(comments, line);
        text.remove_prefix(std::min(text.size(), line.size() + 1));
    }
    return comments;
}

// The labels of a group that save_mesh() has named "label_N" or "label_N_M".
struct GroupLabels {
    std::optional<uint16_t> label, outer;
};

GroupLabels labels_of(std::string_view group) {
    constexpr std::string_view start = "label_";
    if (!group.starts_with(start))
        return {};
    group.remove_prefix(start.size());
    const size_t bar = group.find('_');
    const std::optional<int64_t> label = whole(group.substr(0, bar));
    if (!label || *label < 0 || *label > 65535)
        return {};
    GroupLabels labels{static_cast<uint16_t>(*label), {}};
    if (bar == std::string_view::npos)
        return labels;
    const std::optional<int64_t> outer = whole(group.substr(bar + 1));
    if (!outer || *outer < 0 || *outer > 65535)
        return {};
    labels.outer = static_cast<uint16_t>(*outer);
    return labels;
}

template <size_t N>
bool is_one_of(std::string_view key, const std::string_view (&keys)[N]) {
    return std::find(std::begin(keys), std::end(keys), key) != std::end(keys);
}

constexpr std::string_view kPassedOver[] = {
    "vt",    "s",     "mg",    "usemtl",   "mtllib",   "usemap",     "maplib",   "lod",
    "bevel", "ctech", "stech", "c_interp", "d_interp", "shadow_obj", "trace_obj"};
constexpr std::string_view kFreeForm[] = {"vp",   "cstype", "deg",  "bmat", "step", "curv", "curv2",
                                          "surf", "parm",   "trim", "hole", "scrv", "sp",   "end",
                                          "con",  "bsp",    "bzp",  "cdc",  "cdp",  "res"};

class ObjReader {
 public:
    ObjReader(std::string_view text, const std::string& name, const Counts& counts)
        : lines_(text), first_comments_(first_comments(text)), name_(name), counts_(counts) {
        world_.reserve(counts.points);
        normals_.reserve(counts.normals);
        normal_of_.assign(counts.normals > 0 ? counts.points : 0, kNone);
        loaded_.mesh.triangles.reserve(counts.triangles);
    }

    Result<LoadedMesh> read() {
        do {
            PALPATE_TRY(read_line(lines_.word()));
        } while (lines_.next_line());
        return finish();
    }

 private:
    Result<void> read_line(std::string_view key) {
        if (key.empty() || is_one_of(key, kPassedOver))
            return {};
        if (key == "v" || key == "vn")
            return read_vector(key);
        if (key == "f" || key == "fo")
            return read_face();
        if (key == "g" || key == "o") {
            group_ = labels_of(lines_.word());
            return {};
        }
        if (key == "p" || key == "l") {
            ++passed_over_;
            return {};
        }
        if (is_one_of(key, kFreeForm))
            return fail(
                "{}:{}: holds free-form curves or surfaces ({}), which are not read; write them as "
                "polygons",
                name_, lines_.line(), key);
        return fail("{}:{}: expected a key of OBJ such as v, vn, f or g, found {}", name_,
                    lines_.line(), shown(key));
    }

    // Three numbers; what follows, a weight or a colour, is passed over.
    Result<void> read_vector(std::string_view key) {
        glm::dvec3 vector;
        for (int i = 0; i < 3; ++i) {
            const std::string_view word = lines_.word();
            const std::optional<double> value = Words(word).number();
            if (!value || (key == "v" && !(std::abs(*value) <= 1e12)))
                return fail("{}:{}: expected {}, found {}", name_, lines_.line(),
                            key == "v" ? "a coordinate within 1e12 mm" : "a number of a normal",
                            shown(word));
            vector[i] = *value;
        }
        if (key == "v")
            world_.push_back(vector);
        else
            normals_.push_back(unit_normal(vector));
        return {};
    }

    // 1 is the first, -1 the latest so far.
    Result<uint32_t> index(std::string_view word, uint64_t so_far, uint64_t all, const char* what) {
        const std::optional<int64_t> value = whole(word);
        const int64_t last = static_cast<int64_t>(all), now = static_cast<int64_t>(so_far);
        if (!value || *value == 0 || *value > last || *value < -now)
            return fail("{}:{}: expected a {} from 1 to {} (or -1 to -{}), found {}", name_,
                        lines_.line(), what, all, so_far, shown(word));
        return static_cast<uint32_t>(*value > 0 ? *value - 1 : now + *value);
    }

    // "v", "v/vt", "v//vn" or "v/vt/vn".
    Result<uint32_t> read_corner(std::string_view word) {
        const size_t first = word.find('/');
        Result<uint32_t> point =
            index(word.substr(0, first), world_.size(), counts_.points, "vertex");
        const size_t second = first == std::string_view::npos ? first : word.find('/', first + 1);
        if (!point || second == std::string_view::npos) {
            corners_without_normal_ += 1;
            return point;
        }
        PALPATE_TRY(const uint32_t normal,
                    index(word.substr(second + 1), normals_.size(), counts_.normals, "normal"));
        uint32_t& of_point = normal_of_[*point];
        if (of_point == kNone)
            of_point = normal;
        const bool both_read = std::max(of_point, normal) < normals_.size();
        const bool same =
            of_point == normal || (both_read && normals_[of_point] == normals_[normal]);
        several_normals_ += !same;
        return point;
    }

    Result<void> read_face() {
        Mesh& mesh = loaded_.mesh;
        std::array<uint32_t, 2> fan{}; // the first corner and the last
        size_t corners = 0;
        for (std::string_view word = lines_.word(); !word.empty(); word = lines_.word()) {
            PALPATE_TRY(const uint32_t corner, read_corner(word));
            if (corners >= 2)
                mesh.triangles.emplace_back(fan[0], fan[1], corner);
            fan[corners == 0 ? 0 : 1] = corner;
            ++corners;
        }
        if (corners < 3)
            return fail("{}:{}: expected 3 or more corners in a face, found {}", name_,
                        lines_.line(), corners);
        unlabelled_ += group_.label ? 0 : 1;
        without_outer_ += group_.outer ? 0 : 1;
        if (unlabelled_ == 0)
            mesh.labels.resize(mesh.triangles.size(), *group_.label);
        if (without_outer_ == 0)
            mesh.outer_labels.resize(mesh.triangles.size(), *group_.outer);
        return {};
    }

    // A vertex has a normal where all its corners name the same one.
    void take_normals() {
        if (normals_.empty() || corners_without_normal_ > 0)
            return;
        if (several_normals_ > 0) {
            loaded_.warnings.push_back(fmt::format(
                "{}: has vertices with several normals (hard edges); all normals are left out",
                name_));
            return;
        }
        const bool in_pairs = normals_.size() == world_.size();
        for (uint32_t v = 0; v < world_.size(); ++v) {
            const uint32_t n = normal_of_[v] != kNone ? normal_of_[v] : in_pairs ? v : kNone;
            loaded_.mesh.normals.push_back(n == kNone ? glm::vec3(0.0f) : normals_[n]);
        }
    }

    Result<LoadedMesh> finish() {
        if (world_.empty())
            return fail("{}: expected a mesh with vertices, found none", name_);
        if (unlabelled_ > 0)
            loaded_.mesh.labels.clear();
        if (without_outer_ > 0)
            loaded_.mesh.outer_labels.clear();
        take_normals();
        if (passed_over_ > 0)
            loaded_.warnings.push_back(
                fmt::format("{}: {} points and lines are left out", name_, passed_over_));
        PALPATE_TRY(place_in_world(loaded_, world_, first_comments_, name_));
        return std::move(loaded_);
    }

    ObjLines lines_;
    const std::string first_comments_;
    const std::string& name_;
    const Counts counts_;
    LoadedMesh loaded_;
    std::vector<glm::dvec3> world_;
    std::vector<glm::vec3> normals_;
    std::vector<uint32_t> normal_of_; // of each vertex
    GroupLabels group_;
    uint64_t corners_without_normal_ = 0, several_normals_ = 0, passed_over_ = 0;
    uint64_t unlabelled_ = 0, without_outer_ = 0; // faces
};

} // namespace

Result<LoadedMesh> parse_obj(std::string_view text, const std::string& name, uint64_t limit_bytes) {
    const Counts counts = count(text);
    constexpr uint64_t most = kNone;
    if (counts.points > most || counts.normals > most || counts.triangles > most)
        return fail("{}: expected at most {} vertices, normals and triangles, found more", name,
                    most);
    const bool has_normals = counts.normals > 0;
    const uint64_t needed =
        counts.points * (sizeof(glm::dvec3) + sizeof(glm::vec3) +
                         (has_normals ? sizeof(uint32_t) + sizeof(glm::vec3) : 0)) +
        counts.normals * sizeof(glm::vec3) +
        counts.triangles * (sizeof(glm::uvec3) + 4 * sizeof(uint16_t)); // labels grow by half
    if (needed > limit_bytes)
        return fail("{}: expected a mesh of at most {} bytes, as memory allows, found one of {}",
                    name, limit_bytes, needed);
    return ObjReader(text, name, counts).read();
}

} // namespace palpate::io
