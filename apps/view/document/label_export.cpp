#include "apps/view/document/label_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "apps/view/document/free_name.h"
#include "engine/base/failure.h"
#include "engine/io/dicom_structures_write.h"
#include "engine/io/labels_write.h"
#include "engine/io/mesh_io.h"
#include "engine/io/volume_io.h"
#include "engine/program/surface_labels.h"
#include "engine/surface/surface_nets.h"

namespace palpate::view {

namespace {

constexpr std::array<std::string_view, 4> kMeshes{".ply", ".stl", ".obj", ".vtp"};
constexpr std::string_view kStructures = "rtstruct.dcm"; // how names of structure sets end
constexpr uint32_t kPasses = 10; // of smoothing, as `palpate surface --smooth bounded` has them

// The names and colours that notes give labels.
std::vector<LabelName> all_names(const Notes& notes) {
    std::vector<LabelName> names = notes.label_names;
    for (const auto& [label, style] : notes.label_styles) {
        const auto named =
            std::find_if(names.begin(), names.end(),
                         [&, l = label](const LabelName& n) { return n.label == l; });
        (named == names.end() ? names.emplace_back(LabelName{label, "", {}}) : *named).color =
            style.color;
    }
    std::erase_if(names, [](const LabelName& name) { return name.label == 0; });
    return names;
}

// To the series that the open volume came from.
Result<std::string> export_dicom(const Volume& labels, const std::filesystem::path& path,
                                 const std::stop_token& stop, const std::vector<LabelName>& names,
                                 const LabelSeries& of) {
    ReadOptions read;
    read.stop = stop;
    if (!of.uid.empty())
        read.series = of.uid;
    PALPATE_TRY(const DicomReference reference, load_dicom_reference(of.path, read));
    DicomLabelOptions how;
    how.stop = stop;
    const bool structures = path.filename().string().ends_with(kStructures);
    PALPATE_TRY((structures ? save_dicom_structures : save_dicom_labels)(path, labels, names,
                                                                         reference, how));
    return fmt::format("all labels written to {}, as a DICOM {} of the open series", path.string(),
                       structures ? "structure set" : "segmentation");
}

} // namespace

Result<std::string> export_labels(const Volume& labels, uint16_t label,
                                  const std::filesystem::path& path, const std::stop_token& stop,
                                  const std::vector<LabelName>& names, const LabelSeries& of) {
    if (path.extension() == ".dcm")
        return export_dicom(labels, path, stop, names, of);
    if (std::ranges::find(kMeshes, path.extension().string()) == kMeshes.end()) {
        if (const Result<void> named = expect_volume_name(path); !named)
            return fail("{}; the surface of label {} is written to .ply, .stl, .obj or .vtp",
                        named.error().message, label);
        PALPATE_TRY(save_labels(path, labels, names, stop));
        return fmt::format("all labels written to {}{}", path.string(),
                           names.empty()             ? ""
                           : holds_label_names(path) ? ", with their names"
                                                     : ", without their names: .nii.gz and .nrrd "
                                                       "have a place for them");
    }
    if (!count_labels(labels).contains(label))
        return fail("{}: expected samples of label {}, found none", path.string(), label);
    const Mesh all = surface_nets(labels, {.passes = kPasses, .stop = stop});
    const Mesh mesh = surface_of_label(all, label);
    PALPATE_TRY(save_mesh(path, mesh, {.stop = stop}));
    return fmt::format("label {}: {} triangles written to {}", label, mesh.triangles.size(),
                       path.string());
}

Result<std::string> export_each_label(const Volume& labels, const std::filesystem::path& path,
                                      const std::stop_token& stop,
                                      const std::vector<LabelName>& names) {
    if (std::ranges::find(kMeshes, path.extension().string()) == kMeshes.end())
        return fail("{}: expected .ply, .stl, .obj or .vtp for a file of each label",
                    path.string());
    const auto counts = count_labels(labels);
    const Mesh all = surface_nets(labels, {.passes = kPasses, .stop = stop});
    size_t written = 0;
    for (const auto& [label, count] : counts) {
        if (label == 0 || count == 0)
            continue;
        if (stop.stop_requested())
            return fail("{}: stopped after {} files", path.string(), written);
        const auto named = std::ranges::find(names, label, &LabelName::label);
        const std::string name = file_word(
            named == names.end() || named->name.empty() ? std::to_string(label) : named->name);
        std::filesystem::path file = path;
        file.replace_filename(path.stem().string() + "-" + name + path.extension().string());
        PALPATE_TRY(save_mesh(free_name(file), surface_of_label(all, static_cast<uint16_t>(label)),
                              {.stop = stop}));
        ++written;
    }
    if (written == 0)
        return fail("{}: expected samples of a label, found none", path.string());
    return fmt::format("{} labels written, each to a file: {}", written,
                       (path.parent_path() / (path.stem().string() + "-..")).string());
}

void LabelExport::begin(uint16_t label, const std::string& path, bool each) {
    if (!document_.threaded())
        return document_.tell("a script saves nothing");
    if (done_.valid())
        return document_.tell("writing; one file at a time");
    document_.session().settle();
    const std::optional<Volume> labels = document_.labels();
    if (!labels)
        return document_.tell("there are no labels to write: draw or segment first");
    std::error_code ignored;
    const auto file =
        std::filesystem::absolute(each ? std::filesystem::path(path) : free_name(path), ignored);
    LabelSeries series{document_.path(), {}};
    for (const SeriesInfo& one : document_.series())
        if (one.is_read)
            series.uid = one.uid;
    done_ = std::async(
        std::launch::async, [labels = *labels, label, file, each, series, stop = stop_.get_token(),
                             names = all_names(document_.notes().known())] {
            return attempt(file.string(), [&] {
                return each ? export_each_label(labels, file, stop, names)
                            : export_labels(labels, label, file, stop, names, series);
            });
        });
    document_.tell("writing " + Message::name(file.string()) + " ..");
}

void LabelExport::poll() {
    if (!done_.valid() || done_.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
        return;
    const Result<std::string> done = done_.get();
    last_ = done ? Message::of_files(*done) : Message::why(done.error());
    document_.tell(last_);
}

} // namespace palpate::view
