#include "engine/program/touch_guide.h"

#include <limits>
#include <sstream>
#include <vector>

#include "engine/base/option_name.h"
#include "engine/io/scene_data.h"
#include "engine/program/command.h"
#include "engine/program/option_checks.h"
#include "engine/segment/guide_field.h"

namespace palpate {

namespace {

constexpr std::string_view kPlane = "plane:";

bool is_plane(const std::string& guide) {
    return guide.starts_with(kPlane);
}
struct GuidePlane {
    glm::dvec3 point_mm{0.0}, normal{0.0};
};
Result<GuidePlane> read_plane(const std::string& guide) {
    std::istringstream text(guide.substr(kPlane.size()));
    std::vector<double> numbers;
    for (std::string part; std::getline(text, part, ',');) {
        char* end = nullptr;
        const double number = std::strtod(part.c_str(), &end);
        if (part.empty() || *end != '\0' || !std::isfinite(number))
            return fail("expected plane:X,Y,Z,NX,NY,NZ, found '{}'", guide);
        numbers.push_back(number);
    }
    if (numbers.size() != 6)
        return fail("expected plane:X,Y,Z,NX,NY,NZ, six numbers, found {}", numbers.size());
    const GuidePlane plane{{numbers[0], numbers[1], numbers[2]},
                           {numbers[3], numbers[4], numbers[5]}};
    if (!(glm::length(plane.normal) > 1e-9))
        return fail("expected a normal NX,NY,NZ of some length, found 0");
    return plane;
}

} // namespace

void add_guide_option(CLI::App& app, std::string& guide) {
    app.add_option("--guide", guide,
                   "What draws the hand, of guide-inside and guide-onto, with --stiffness, at most "
                   "--yield: labels (into those of --labels), edges (of the values), "
                   "plane:X,Y,Z,NX,NY,NZ (mm), or a volume of distances in mm (default: none)")
        ->check(readable([](const std::string& text) -> Result<void> {
            if (is_plane(text))
                PALPATE_TRY(read_plane(text));
            return {};
        }))
        ->type_name("WHAT");
}

const char* algorithm_of_guide(const std::string& guide) {
    return is_plane(guide) ? "guide-onto" : "guide-inside";
}

Result<void> check_guide_felt(const std::string& guide, const haptics::AlgorithmEntry& algorithm) {
    if (algorithm.is_guide && guide.empty())
        return fail("{} {}: needs a {}", Option{"algorithm"}, algorithm.name, Option{"guide"});
    if (!algorithm.is_guide && !guide.empty()) {
        std::string guides;
        for (const haptics::AlgorithmEntry& entry : haptics::algorithms())
            if (entry.is_guide)
                guides += fmt::format("{}{}", guides.empty() ? "" : " or ", entry.name);
        return fail("{}: is felt by {}, and not by {}", Option{"guide"}, guides, algorithm.name);
    }
    return {};
}

bool is_guide_file(const std::string& guide) {
    return !guide.empty() && guide != "labels" && guide != "edges" && !is_plane(guide);
}

Result<Volume> load_guide(const std::string& guide, const Feel& feel, std::stop_token stop) {
    const Task task{stop, {}};
    if (is_plane(guide)) {
        PALPATE_TRY(const GuidePlane plane, read_plane(guide));
        return guide_to_plane(feel.scene.grey->grid(), plane.point_mm, plane.normal);
    }
    if (guide == "edges")
        return guide_to_edges(*feel.scene.grey, {}, task);
    if (guide == "labels") {
        if (!feel.scene.labels)
            return fail("{} labels: expected {}, or labels as SCENE, found none", Option{"guide"},
                        Option{"labels"});
        return guide_to_labels(*feel.scene.labels, std::numeric_limits<double>::infinity(), task);
    }
    SceneFile file;
    file.volume = guide;
    PALPATE_TRY(LoadedScene loaded, load_scene_data(file, {.stop = stop}));
    return std::move(loaded.data.volume);
}

} // namespace palpate
