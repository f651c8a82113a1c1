// The part of the viewer that opens files, and asks what becomes of one that was read.

#include <algorithm>
#include <filesystem>

#include "apps/view/document/label_import.h"
#include "apps/view/window/viewer.h"
#include "engine/base/log.h"
#include "engine/base/memory.h"
#include "engine/scene/value_survey.h"
#include "engine/session/default_scene.h"
#include "engine/volume/extent.h"

namespace palpate::view {

void Viewer::show_opening(const std::string& path) {
    state_.opening = path;
    state_.opening_since_s = time_s_;
    state_.opening_share = 0.0;
}

bool Viewer::may_open() {
    if (opening_.is_under_way())
        work_->tell("a file is being read: cancel it first");
    return !opening_.is_under_way();
}

// Numbers of labels that lie where a volume lies, in a file of their own.
static bool fits_as_labels(const Source& source, const std::string& path, const Grid& grid) {
    const LoadedScene& loaded = source.scene.loaded;
    return !source.project && !loaded.data.labels && !loaded.data.fused && !is_synthetic(path) &&
           std::filesystem::path(path).extension() != ".json" &&
           (!loaded.label_names.empty() || is_label_map(loaded)) &&
           apart_text(path, loaded.data.volume.grid(), grid).empty();
}

void Viewer::open(const std::string& path, const std::string& series) {
    if (!options_.open || !may_open())
        return;
    state_.file_question.reset();
    forget_label_map();
    show_opening(path);
    const bool is_open = path == work_->path() || shows_example_;
    const std::optional<Grid> under = is_open ? std::nullopt : std::optional(grid());
    opening_.begin(path, series.empty(),
                   [open = options_.open, path, series, under](
                       const std::stop_token& stop,
                       const std::function<void(double)>& progress) -> Result<Source> {
                       PALPATE_TRY(Source source, open(path, series, stop, progress));
                       source.fits_as_labels = under && fits_as_labels(source, path, *under);
                       return source;
                   });
    if (!options_.threaded)
        poll_opening();
}

void Viewer::open_last() {
    const auto recent = options_.recent ? options_.recent("") : std::vector<std::string>();
    const auto last = std::find_if(recent.begin(), recent.end(),
                                   [&](const std::string& path) { return path != work_->path(); });
    if (last == recent.end())
        return work_->tell("nothing else was opened before");
    state_.browser_open = false;
    ask_to_leave({.path = *last});
}

void Viewer::open_beside(const std::string& path, bool labels) {
    if (!options_.open_beside || !may_open())
        return;
    if (figure_ && !labels)
        return work_->tell("a figure is being drawn: open the volume after it");
    const auto read = [open = options_.open_beside, path, labels, grid = work_->subject().grid](
                          const std::stop_token& stop,
                          const std::function<void(double)>& progress) -> Result<FileBeside> {
        PALPATE_TRY(LoadedVolume opened, open(path, labels, stop, progress));
        const bool is_map = labels || !opened.labels.empty() ||
                            (opened.modality.empty() &&
                             looks_like_labels(opened.volume, survey_values(opened.volume)));
        if (is_map && !labels) {
            PALPATE_TRY(opened, open(path, true, stop, progress)); // whole numbers, of their type
        }
        if (is_map && !(opened.volume.range().max > 0.0f))
            return fail("{}: expected labels, found a map of zeros", path);
        for (const std::string& note : all_notes(opened))
            log::info("{}", note);
        opened.notes.clear();
        if (is_map) {
            PALPATE_TRY(opened, on_grid(std::move(opened), grid, stop));
        } else if (const std::string apart = apart_text(path, opened.volume.grid(), grid);
                   !apart.empty()) {
            return fail("{}", apart);
        }
        return FileBeside{std::move(opened), is_map};
    };
    show_opening(path);
    opening_.begin_beside(path, labels, read);
    if (!options_.threaded)
        poll_opening();
}

void Viewer::poll_opening() {
    if (label_map_ && !state_.file_question)
        forget_label_map();
    if (!opening_.is_under_way())
        return;
    state_.opening_share = opening_.share();
    if (auto opened = opening_.take())
        take_opened(std::move(*opened));
    else if (!work_->hand().is_drawing())
        if (auto beside = opening_.take_beside())
            take_beside(std::move(*beside));
}

// How many files of an image's kind lie in its folder, itself among them; 0: it is no image.
static size_t images_beside(const std::filesystem::path& path) {
    constexpr std::string_view kinds[] = {"",     ".dcm",  ".DCM", ".IMA",  ".ima", ".png",
                                          ".jpg", ".jpeg", ".bmp", ".tiff", ".tif"};
    std::error_code ignored;
    const std::string kind = path.extension().string();
    if (!std::filesystem::is_regular_file(path, ignored) ||
        std::find(std::begin(kinds), std::end(kinds), kind) == std::end(kinds))
        return 0;
    size_t images = 0;
    for (const auto& entry : std::filesystem::directory_iterator(
             std::filesystem::absolute(path).parent_path(), ignored))
        images += entry.path().extension() == kind && entry.is_regular_file(ignored);
    return images;
}

void Viewer::tell_unopened(const Error& error) {
    const bool cancelled = opening_.is_cancelled();
    saved_ = {};
    if (!cancelled)
        log::error("{}", error.message);
    work_->tell(cancelled ? "opening was cancelled" : Message::why(error));
}

void Viewer::take_beside(Result<FileBeside> opened) {
    state_.opening.clear();
    if (!opened)
        return tell_unopened(opened.error());
    for (const std::string& warning : opened->read.warnings)
        log::warning("{}", warning);
    if (!opened->is_labels)
        return show_fused(std::move(opened->read));
    if (opening_.is_of_labels())
        return work_->take_labels(std::move(opened->read));
    if (work_->has_labels())
        return work_->tell(
            "the file holds labels, and this volume has some: \"labels of a file..\" "
            "in the task Segment takes them in their place");
    work_->take_labels(std::move(opened->read));
    work_->tell_also("it holds labels, and no second volume");
}

// It is no part of the document: a project does not have it.
void Viewer::show_fused(LoadedVolume opened) {
    drop_pictures();
    pictures_with_.fused = std::move(opened.volume);
    work_->show_fused(FusionLayer{default_fusion_transfer(pictures_with_.fused->range()), 0.5});
    state_.fusion_opacity = 0.5;
    make_pictures();
    for (const std::string& warning : opened.warnings)
        work_->tell_also(Message::of_files(warning));
}

void Viewer::take_opened(Result<Source> opened) {
    const std::string path = std::exchange(state_.opening, {});
    if (!opened)
        return tell_unopened(opened.error());
    if (opened->fits_as_labels && options_.open_beside)
        ask_about(std::move(*opened), path);
    else
        show_opened(std::move(*opened), path);
}

void Viewer::ask_about(Source label_map, const std::string& path) {
    label_map_ = std::move(label_map);
    state_.file_question = {
        .about = FileQuestion::About::label_map, .path = path, .replaces = work_->has_labels()};
}

void Viewer::forget_label_map() {
    if (!label_map_)
        return;
    // Its steps are kept from its opening on, and there are none.
    std::filesystem::path steps;
    if (label_map_->steps && label_map_->steps->recovered == 0)
        steps = label_map_->steps->path;
    label_map_.reset();
    StepsFile(steps, 0).discard();
}

void Viewer::show_opened(Source source, const std::string& path) {
    const ViewState before = state_;
    work_->steps_file().drop();
    begin(std::move(source));
    shows_example_ = false;
    return_free_memory_now(); // of the document that was open
    state_.names_hidden = before.names_hidden;
    state_.light = before.light;
    state_.indices_shown = before.indices_shown;
    state_.hints = before.hints;
    state_.text_scale = before.text_scale;
    state_.task = before.task;
    state_.sections = before.sections;
    state_.panel_px = before.panel_px;
    state_.series_open = opening_.asks_series() && work_->series().size() > 1;
    if (const size_t images = images_beside(path); images > 1 && work_->subject().grid.size.z == 1)
        state_.file_question = {.about = FileQuestion::About::one_of_many,
                                .path = std::filesystem::absolute(path).parent_path().string(),
                                .images = images};
    if (const Message saved = std::exchange(saved_, {}); !saved.empty())
        work_->tell_also(saved);
    if (options_.recent)
        interface_->set_recent(options_.recent(path));
}

} // namespace palpate::view
