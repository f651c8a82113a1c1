#include "apps/view/document/open_document.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "engine/measure/label_statistics.h"
#include "engine/session/default_scene.h"

namespace palpate::view {

namespace {

std::string title_of(const Source& source) {
    if (source.project)
        return source.project->project.folder().filename().string();
    const std::string& volume = source.scene.file.volume;
    return is_synthetic(volume) ? volume : std::filesystem::path(volume).filename().string();
}

} // namespace

OpenDocument::OpenDocument(Source& source, glm::uvec2 window_px, double text_scale, bool threaded)
    : threaded_(threaded),
      file_(source.scene.file),
      title_(title_of(source)),
      loaded_(source.scene.loaded),
      unit_(value_unit(loaded_)),
      zero_hu_(palpate::zero_hu(loaded_)),
      steps_file_(source.steps ? StepsFile(source.steps->path, source.steps->recovered)
                               : StepsFile()),
      session_(setup_of(source, threaded)),
      first_grey_(std::move(source.first_grey)),
      notes_(session_),
      grey_(session_.sources().grey),
      labels_(session_.sources().labels),
      fusion_(source.scene.scene.fusion) {
    if (source.project) {
        for (const std::string& text : source.project->notes)
            tell_also(Message::of_files(text));
        if (const size_t steps = source.project->unsaved)
            tell_also(fmt::format("{} step{} since the last save {} there", steps,
                                  steps == 1 ? "" : "s", steps == 1 ? "is" : "are"));
    }
    if (source.steps)
        tell_also(Message::of_files(source.steps->note));
    tell_also(said_of(loaded_, path(), title_));
    subject_ = subject_of(source.scene, session_, notes_.known());
    subject_.home.size_px = window_px;
    subject_.home.text_scale = text_scale;
    subject_.value_at = [this](glm::dvec3 point_mm) -> std::optional<double> {
        const float value = value_at(grey_, point_mm).value_or(NAN);
        return std::isnan(value) ? std::nullopt : std::optional<double>(value);
    };
    subject_.has_labels = [this] { return has_labels(); };
    subject_.label_at = [this](glm::dvec3 point_mm) {
        return static_cast<uint16_t>(value_at(labels_, point_mm).value_or(0.0f));
    };
}

void OpenDocument::tell_also(const Message& message) {
    if (!message_.empty() && !message.empty())
        message_ += "; ";
    message_ += message;
}

Volume OpenDocument::grey() {
    return *edited().document.find(grey_);
}

std::optional<Volume> OpenDocument::find(const std::string& volume) {
    const EditState now = edited();
    const Volume* there = now.document.find(volume);
    return there ? std::optional(*there) : std::nullopt;
}

std::optional<Volume> OpenDocument::labels() {
    return find(labels_);
}

std::optional<Volume> OpenDocument::seeds() {
    return find(kSeeds);
}

Volume OpenDocument::labels_or_empty() {
    const std::optional<Volume> there = labels();
    return there ? *there : empty_labels(subject_.grid);
}

bool OpenDocument::has_labels() {
    const std::optional<Volume> there = labels();
    return there && there->range().max > 0.0f;
}

std::string OpenDocument::name_of_label(uint32_t label) const {
    return numbered_name(notes_.known(), label);
}

std::string OpenDocument::locked_text(uint16_t label) const {
    return fmt::format("label {} is locked and stays", name_of_label(label));
}

std::optional<double> OpenDocument::label_sample_mm3() {
    const std::optional<Volume> there = labels();
    return there ? std::optional(sample_mm3(there->grid())) : std::nullopt;
}

std::optional<float> OpenDocument::value_at(const std::string& volume, glm::dvec3 point_mm) {
    const std::optional<Volume> in = find(volume);
    const auto sample = in ? sample_at(in->grid(), point_mm) : std::nullopt;
    return sample ? std::optional(in->value(*sample)) : std::nullopt;
}

std::string OpenDocument::values_at(glm::dvec3 point_mm) {
    if (!sample_at(subject_.grid, point_mm))
        return "";
    const float value = value_at(grey_, point_mm).value();
    std::string text = std::isnan(value) ? "no data" : fmt::format("{:g}", value);
    if (!unit_.empty() && !std::isnan(value))
        text += " " + unit_;
    if (const auto label = subject_.label_at(point_mm))
        text += fmt::format("  label {}", name_of_label(label));
    return text;
}

std::string OpenDocument::text_at(glm::dvec3 point_mm) {
    const auto sample = sample_at(subject_.grid, point_mm);
    return sample ? fmt::format("({}, {}, {})  {}", sample->x, sample->y, sample->z,
                                values_at(point_mm))
                  : "";
}

EditLimits OpenDocument::limits() {
    return {notes_.known().locked_labels, mask_,
            mask_.values ? std::optional(grey()) : std::nullopt};
}

bool OpenDocument::put_labels(Volume labels, std::string step, Json parameters,
                              NotePages::Texts notes) {
    return session_.put({labels_, VolumeKind::labels, std::move(labels)}, std::move(step),
                        std::move(parameters), std::move(notes), limits());
}

bool OpenDocument::make_labels() {
    return labels() || put_labels(empty_labels(subject_.grid), "new label map");
}

bool OpenDocument::make_seeds() {
    return seeds() ||
           session_.put({kSeeds, VolumeKind::labels, empty_labels(subject_.grid)}, "seeds");
}

bool OpenDocument::clear_seeds() {
    return session_.put({kSeeds, VolumeKind::labels, empty_labels(subject_.grid)}, "clear seeds");
}

void OpenDocument::take_labels(LoadedVolume labels) {
    Notes notes = notes_.known();
    notes.label_names.clear(); // those of other labels, as are the colours
    notes.label_styles.clear();
    for (const LabelName& name : labels.labels) {
        if (name.label == 0 || name.label > 65535)
            continue;
        name_label(notes, name.label, name.name);
        if (name.color)
            set_style(notes, name.label, {*name.color, true});
    }
    if (!session_.put({labels_, VolumeKind::labels, std::move(labels.volume)}, "labels of a file",
                      Json::object(), notes_.changes_to(notes)))
        return;
    notes_.expect_change();
    tell("labels read from the file");
    for (const auto* said : {&labels.warnings, &labels.notes})
        for (const std::string& text : *said)
            tell_also(Message::of_files(text));
}

bool is_locked(const ViewState& state, uint16_t label) {
    return std::binary_search(state.notes.locked_labels.begin(), state.notes.locked_labels.end(),
                              label);
}

} // namespace palpate::view
