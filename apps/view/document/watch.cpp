// Numbers about the document, and notes that are kept with it.

#include <algorithm>
#include <filesystem>
#include <span>

#include "apps/view/document/free_name.h"
#include "apps/view/document/work.h"
#include "engine/base/file.h"
#include "engine/measure/measure_report.h"

namespace palpate::view {

namespace {
constexpr uint64_t kMostCounted = uint64_t{1} << 28; // samples; of more, a coarser level

std::string replaced(std::string text, const std::string& what, const std::string& by) {
    if (!what.empty())
        for (size_t at = 0; (at = text.find(what, at)) != text.npos; at += by.size())
            text.replace(at, what.size(), by);
    return text;
}
} // namespace

void Work::watch(const ViewState& state) {
    set_mask(edit_mask(state));
    Scene scene = session().scene();
    show_in_scene(state.notes, scene);
    if (scene != session().scene())
        session().show(std::move(scene));
    segmentation_.show(state);
    const EditState edit = edited();
    const Volume& grey = *edit.document.find(grey_name());
    Figures::Wish wish{grey, grey, {}, {}, is_shown(state, Section::labels)};
    if (sample_count(grey.grid()) > kMostCounted)
        for (const Volume& level : loaded().coarser)
            if (sample_count(wish.counted.grid()) > kMostCounted)
                wish.counted = level;
    if (const Volume* labels = edit.document.find(labels_name()))
        wish.labels = *labels;
    for (const Measure& measure : state.notes.measures)
        if (measure.kind == MeasureKind::polygon || measure.kind == MeasureKind::sphere)
            wish.measures.push_back(measure);
    figures_.want(std::move(wish));
}

std::string series_text(const SeriesInfo& series, bool names_hidden) {
    const bool has_words = !names_hidden && !series.description.empty();
    return fmt::format("{}{}, {}", series.modality,
                       has_words ? fmt::format(" '{}'", series.description) : "", series.content);
}

Message said_of(const LoadedScene& loaded, const std::string& path, const std::string& title) {
    constexpr size_t kMostLetters = 300;
    std::vector<std::string> all = loaded.warnings;
    all.insert(all.end(), loaded.notes.begin(), loaded.notes.end());
    std::string said;
    for (size_t i = 0; i < all.size(); ++i) {
        const std::string one = title.empty() ? all[i] : replaced(all[i], path, title);
        if (i > 0 && said.size() + one.size() > kMostLetters)
            return Message::of_files(said) +
                   fmt::format("; and {} more on standard error", all.size() - i);
        said += (i > 0 ? "; " : "") + one;
    }
    return Message::of_files(said);
}

std::optional<Measured> Work::measured(const Measure& one) {
    if (one.kind == MeasureKind::ruler || one.kind == MeasureKind::angle)
        return measure(one, loaded().data.volume); // reads no sample
    for (const auto& [known, measured] : figures_.known()->measured) {
        Measure same = known;
        same.name = one.name;
        if (same == one)
            return measured;
    }
    return std::nullopt;
}

void Work::export_measures(const ViewState& state, const std::string& path) {
    if (!threaded()) {
        message_ = "a script saves nothing";
        return;
    }
    MeasureReport report;
    report.unit = unit();
    for (const Measure& one : state.notes.measures) {
        std::optional<Measured> now = measured(one);
        if (!now) {
            message_ = "not all is measured yet: try again";
            return;
        }
        report.measures.push_back({one, std::move(*now)});
    }
    const std::string text = report_csv(report);
    std::error_code ignored;
    const auto file = std::filesystem::absolute(free_name(path), ignored);
    const Result<void> saved = save_bytes(file, std::as_bytes(std::span(text)));
    message_ =
        saved ? "measures written: " + Message::name(file.string()) : Message::why(saved.error());
}

} // namespace palpate::view
