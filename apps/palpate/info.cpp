#include <CLI/CLI.hpp>
#include <cmath>

#include "apps/palpate/command.h"
#include "engine/base/json.h"
#include "engine/base/printable.h"
#include "engine/io/volume_io.h"
#include "engine/program/interrupt.h"
#include "engine/program/output.h"
#include "engine/program/read_options.h"

namespace palpate {

namespace {

// The outermost samples of both ends, LPS mm.
glm::dvec3 first_sample(const Grid& grid) {
    return world_point(grid, glm::dvec3(0.0));
}
glm::dvec3 last_sample(const Grid& grid) {
    return world_point(grid, glm::dvec3(grid.size) - 1.0);
}

// The same place in the axes that NIfTI and 3D Slicer use: right, anterior, superior.
glm::dvec3 ras_of(glm::dvec3 lps) {
    return {0.0 - lps.x, 0.0 - lps.y, lps.z};
}

// In the axes of this program and in those of others.
std::string place_text(glm::dvec3 lps) {
    const glm::dvec3 ras = ras_of(lps);
    return fmt::format("{:g}, {:g}, {:g} mm LPS (left, posterior, superior); {:g}, {:g}, {:g} RAS",
                       lps.x, lps.y, lps.z, ras.x, ras.y, ras.z);
}

Json json_of(glm::dvec3 v) {
    return {v.x, v.y, v.z};
}

Json json_of(const LoadedVolume& loaded) {
    const Volume& volume = loaded.volume;
    const Grid& grid = volume.grid();
    const glm::dvec3 spacing = spacing_mm(grid);
    Json matrix = Json::array();
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            matrix.push_back(grid.world_from_index[column][row]);
    Json json;
    json["size"] = {grid.size.x, grid.size.y, grid.size.z};
    json["spacing_mm"] = {spacing.x, spacing.y, spacing.z};
    json["world_from_index"] = matrix;
    json["corners_mm"] = {
        {"lps", {json_of(first_sample(grid)), json_of(last_sample(grid))}},
        {"ras", {json_of(ras_of(first_sample(grid))), json_of(ras_of(last_sample(grid)))}}};
    json["type"] = name_of(volume.type());
    json["range"] = volume.range().empty() ? Json() : Json{volume.range().min, volume.range().max};
    json["no_data_count"] = volume.no_data_count();
    if (!loaded.modality.empty())
        json["modality"] = loaded.modality;
    if (loaded.inverted)
        json["photometric_interpretation"] = "MONOCHROME1";
    for (const LabelName& label : loaded.labels) {
        Json entry{{"label", label.label}, {"name", label.name}};
        if (label.color)
            entry["color"] = {label.color->x, label.color->y, label.color->z};
        json["labels"].push_back(entry);
    }
    json["warnings"] = loaded.warnings;
    return json;
}

// The direction of an index axis in the patient: "left 100 %, posterior 3 %", largest share first.
std::string direction_words(glm::dvec3 axis) {
    constexpr const char* words[3][2] = {
        {"right", "left"}, {"anterior", "posterior"}, {"inferior", "superior"}};
    int largest = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(axis[i]) > std::abs(axis[largest]))
            largest = i;
    const double share = std::abs(axis[largest]) / glm::length(axis);
    const double degrees = std::acos(std::min(1.0, share)) * 180.0 / std::acos(-1.0);
    const char* word = words[largest][axis[largest] > 0 ? 1 : 0];
    return degrees < 0.05 ? word : fmt::format("{} ({:.1f} degrees off)", word, degrees);
}

std::string text_of(const LoadedVolume& loaded) {
    const Volume& volume = loaded.volume;
    const Grid& grid = volume.grid();
    const glm::dvec3 spacing = spacing_mm(grid);
    const glm::dmat4& m = grid.world_from_index;
    std::string text = fmt::format(
        "size       {} x {} x {}\n"
        "spacing    {:g} x {:g} x {:g} mm\n"
        "x towards  {}\n"
        "y towards  {}\n"
        "z towards  {}\n"
        "first at   {}\n"
        "last at    {}\n"
        "type       {}\n",
        grid.size.x, grid.size.y, grid.size.z, spacing.x, spacing.y, spacing.z,
        direction_words(glm::dvec3(m[0])), direction_words(glm::dvec3(m[1])),
        direction_words(glm::dvec3(m[2])), place_text(first_sample(grid)),
        place_text(last_sample(grid)), name_of(volume.type()));
    if (volume.range().empty())
        text += "range      none, there is no data\n";
    else
        text += fmt::format("range      {:g} .. {:g}\n", volume.range().min, volume.range().max);
    text +=
        fmt::format("no data    {} of {} samples\n", volume.no_data_count(), sample_count(grid));
    if (!loaded.modality.empty())
        text += fmt::format("modality   {}\n", printable(loaded.modality));
    if (loaded.inverted)
        text += "shown      inverted: small values are bright (MONOCHROME1)\n";
    for (const LabelName& label : loaded.labels) {
        text += fmt::format("label {:<5}{}", label.label, printable(label.name));
        if (label.color) {
            const glm::uvec3 byte(glm::round(*label.color * 255.0));
            text += fmt::format(" (#{:02x}{:02x}{:02x})", byte.x, byte.y, byte.z);
        }
        text += '\n';
    }
    return text;
}

struct InfoOptions {
    ReadFlags read;
    bool labels = false;
    bool json = false;
};

Result<void> run_info(const InfoOptions& options) {
    const Interrupt interrupt;
    PALPATE_TRY(const LoadedVolume loaded, load(options.read, options.labels, interrupt));
    return options.json ? print_report(report_text(json_of(loaded))) : print_text(text_of(loaded));
}

} // namespace

Command add_info(CLI::App& app) {
    auto options = std::make_shared<InfoOptions>();
    add_read_flags(app, options->read);
    app.add_flag("--labels", options->labels, "Read as a label map (default: grey values)");
    app.add_flag("--json", options->json,
                 "Print JSON for programs (default: text for people); lengths are in mm");
    return {[options] { return run_info(*options); },
            [options] {
                std::vector<NamedFile> files;
                append_volume(files, "V", options->read.path);
                return files;
            }};
}

} // namespace palpate
