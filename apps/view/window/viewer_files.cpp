// The part of the viewer that opens, leaves and writes files.

#include <algorithm>
#include <filesystem>

#include "apps/view/document/free_name.h"
#include "apps/view/document/label_import.h"
#include "apps/view/window/viewer.h"
#include "engine/base/failure.h"
#include "engine/base/log.h"
#include "engine/base/memory.h"
#include "engine/image/png.h"
#include "engine/program/figure_options.h"
#include "engine/program/turntable.h"
#include "engine/session/default_scene.h"
#include "engine/volume/extent.h"

namespace palpate::view {

namespace {

Message written(const std::filesystem::path& path) {
    return "picture written: " + Message::name(std::filesystem::absolute(path).string());
}

} // namespace

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

void Viewer::open(const std::string& path, const std::string& series) {
    if (!options_.open || !may_open())
        return;
    show_opening(path);
    opening_.begin(path, series.empty(),
                   [open = options_.open, path, series](
                       const std::stop_token& stop, const std::function<void(double)>& progress) {
                       return open(path, series, stop, progress);
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
                          const std::function<void(double)>& progress) -> Result<LoadedVolume> {
        PALPATE_TRY(LoadedVolume opened, open(path, labels, stop, progress));
        if (labels && !(opened.volume.range().max > 0.0f))
            return fail("{}: expected labels, found a map of zeros", path);
        for (const std::string& note : all_notes(opened))
            log::info("{}", note);
        opened.notes.clear();
        if (labels)
            return on_grid(std::move(opened), grid, stop);
        if (const std::string apart = apart_text(path, opened.volume.grid(), grid); !apart.empty())
            return fail("{}", apart);
        return opened;
    };
    show_opening(path);
    opening_.begin_beside(path, labels, read);
    if (!options_.threaded)
        poll_opening();
}

void Viewer::ask_to_leave(Leaving leaving) {
    state_.leaving = std::move(leaving);
    state_.saving_open = false; // one question at a time
    if (!work_->leaving_loses_edits())
        leave();
}

void Viewer::leave() {
    const Leaving leaving = *std::exchange(state_.leaving, std::nullopt);
    if (leaving.closes) {
        work_->steps_file().drop();
        done_ = true;
    } else {
        open(leaving.path, leaving.series);
    }
}

// A session without a project is asked for a folder first.
void Viewer::save(const order::Save& order) {
    if (order.folder.empty() && !work_->saving().has_project())
        state_.saving_open = state_.saving_typing = true;
    else
        work_->obey(order, state_);
    ask_where_again();
}

// After a new project could not be made there.
void Viewer::ask_where_again() {
    std::optional<Saving::FailedSave> failed = work_->saving().take_failed_save();
    if (!failed)
        return;
    state_.saving_open = state_.saving_typing = true;
    state_.saving_folder = std::move(failed->folder);
    state_.saving_failed = std::move(failed->reason);
}

void Viewer::leave_when_saved() {
    if (!state_.leaving || !state_.leaving->saving || state_.saving_open ||
        work_->saving().is_saving() || (state_.leaving->applying && work_->mesh_pulling().share()))
        return;
    if (std::exchange(state_.leaving->applying, false) && !work_->mesh_pulling().is_pulled())
        save({});
    else if (work_->leaving_loses_edits())
        state_.leaving.reset(); // the save was cancelled, or failed and says why
    else
        leave();
}

// For a window without a file. Pictures come one after the other.
void Viewer::offer_files() {
    welcome_.items =
        welcome_items(options_.recent ? options_.recent("") : std::vector<std::string>());
    if (options_.small_picture)
        welcome_.pictures = std::make_unique<SeriesPreviews>(
            [make = options_.small_picture, items = welcome_.items](
                size_t i, const std::stop_token&) { return make(items[i].path); },
            welcome_.items.size(), options_.threaded);
    interface_->show_welcome(&welcome_);
}

// Pictures of series are made while the chooser is open.
void Viewer::follow_previews() {
    if (!state_.series_open || !options_.preview) {
        previews_.reset();
    } else if (!previews_) {
        std::vector<uint32_t> numbers;
        for (const SeriesInfo& series : work_->series())
            numbers.push_back(series.number);
        previews_ = std::make_unique<SeriesPreviews>(options_.preview, work_->path(), numbers,
                                                     options_.threaded);
    }
    if (previews_ && previews_->poll()) {
        new_previews_ = true;
        ++looks_;
    }
    interface_->show_previews(previews_.get());
    if (welcome_.pictures && welcome_.pictures->poll()) {
        new_welcome_ = true;
        ++looks_;
    }
}

void Viewer::poll_opening() {
    if (!opening_.is_under_way())
        return;
    state_.opening_share = opening_.share();
    if (auto opened = opening_.take())
        take_opened(std::move(*opened));
    else if (!work_->hand().is_drawing())
        if (auto beside = opening_.take_beside())
            take_beside(std::move(*beside));
}

// How many files of a DICOM file's kind lie in its folder, itself among them; 0: it is none.
static size_t images_beside(const std::filesystem::path& path) {
    std::error_code ignored;
    const std::string kind = path.extension().string();
    if (!std::filesystem::is_regular_file(path, ignored) ||
        (!kind.empty() && kind != ".dcm" && kind != ".DCM" && kind != ".IMA"))
        return 0;
    size_t images = 0;
    for (const auto& entry : std::filesystem::directory_iterator(path.parent_path(), ignored))
        images += entry.path().extension() == kind && entry.is_regular_file(ignored);
    return images;
}

void Viewer::tell_unopened(const Error& error) {
    const bool cancelled = opening_.is_cancelled();
    if (!cancelled)
        log::error("{}", error.message);
    work_->tell(cancelled ? "opening was cancelled" : Message::why(error));
}

void Viewer::take_beside(Result<LoadedVolume> opened) {
    state_.opening.clear();
    if (!opened)
        return tell_unopened(opened.error());
    for (const std::string& warning : opened->warnings)
        log::warning("{}", warning);
    if (opening_.is_of_labels())
        work_->take_labels(std::move(*opened));
    else
        show_fused(std::move(*opened));
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
    const ViewState before = state_;
    work_->steps_file().drop();
    begin(std::move(*opened));
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
        work_->tell_also(
            fmt::format("one image of {} files: open their folder for the series", images));
    if (options_.recent)
        interface_->set_recent(options_.recent(path));
}

std::string Viewer::file_name() const {
    return state_.names_hidden || is_synthetic(work_->title())
               ? "palpate"
               : std::filesystem::path(work_->title()).stem().string();
}

// Saves a picture of the window, in the current folder.
void Viewer::save_picture() {
    if (!options_.threaded) {
        work_->tell("a script saves nothing");
        return;
    }
    const std::filesystem::path path = free_name(file_name() + ".png", 1);
    const Result<void> saved = save_png(path, capture());
    work_->tell(saved ? written(path) : Message::why(saved.error()));
}

// Prints a figure of a view: without what belongs to the window alone, as the tool of a hand. A
// thread of its own asks for one picture after the other, and the views are drawn between them.
void Viewer::print_figure(const std::string& file) {
    if (!options_.threaded) {
        work_->tell("a script saves nothing");
        return;
    }
    if (figure_) {
        work_->tell("a figure is being drawn; one at a time");
        return;
    }
    const FigureSetup& figure = state_.figure;
    TurntableOptions turn;
    if (figure.panel == Panel::volume && figure.pictures > 1)
        turn.frames = static_cast<uint32_t>(figure.pictures);
    std::filesystem::path path(file);
    const bool is_movie = turn.frames > 0 && path.extension() == ".mp4";
    if (!is_movie && path.extension() != ".png") {
        work_->tell(fmt::format("expected a name ending in .png{}, found ",
                                turn.frames > 0 ? " or .mp4" : "") +
                    Message::name(fmt::format("'{}'", file)));
        return;
    }
    if (turn.frames > 0 && !is_movie && file.find_first_of("#%") == file.npos)
        path.replace_filename(path.stem().string() + "-####.png");
    const Result<void> named = check_together(turn, path.string());
    const std::vector<std::string> names = frame_names(turn, path.string());
    const auto there = std::find_if(names.begin(), names.end(), [](const std::string& name) {
        return std::filesystem::exists(name);
    });
    if (!named || there != names.end()) {
        work_->tell(named ? Message::name(*there) + " is there already: choose another name"
                          : Message::why(named.error()));
        return;
    }
    if (names.empty())
        path = free_name(path);
    const Grid& grid = work_->subject().grid;
    Scene scene =
        scene_of(state_, grid, figure.panel, work_->session().scene(), work_->has_labels());
    scene.size_px = glm::uvec2(figure.size_px);
    if (is_slice(figure.panel))
        scene.camera = camera_of(state_.slices[static_cast<size_t>(figure.panel)],
                                 state_.crosshair_mm, grid, figure.size_px);
    scene.background = glm::dvec3(figure.paper == Paper::white ? 1.0 : 0.0);
    const bool transparent = figure.paper == Paper::transparent && !is_movie;
    Figure marks{.letters = figure.letters,
                 .scale_bar = figure.scale_bar,
                 .color_bar = figure.color_bar,
                 .unit = work_->unit(),
                 .transparent = transparent};
    if (const auto labels = work_->labels(); figure.legend && labels && scene.labels)
        marks.legend = legend_of(scene, *labels, state_.notes.label_names);
    if (figure.note)
        marks.note = note_of(scene, grid, file_name(), work_->unit());
    figure_ = std::make_unique<FigureRun>();
    figure_->pictures = std::max(1u, turn.frames);
    const auto draw = [pictures = pictures_.get(), run = figure_.get(), panel = figure.panel, scene,
                       look = PictureLook{.transparent = transparent, .figure = marks}](
                          const Camera& camera, const std::string& to) -> Result<void> {
        const auto outcome = std::make_shared<std::promise<Result<void>>>();
        std::future<Result<void>> drawn = outcome->get_future();
        Pictures::Print print{{panel, scene, {}}, look, to, [outcome](Result<void> result) {
                                  outcome->set_value(std::move(result));
                              }};
        print.wish.scene.camera = camera;
        pictures->print(std::move(print));
        Result<void> result = drawn.get();
        ++run->drawn;
        if (run->on_drawn)
            run->on_drawn();
        return result;
    };
    figure_->on_drawn = options_.on_picture;
    figure_->written = std::async(
        std::launch::async,
        [draw, turn, path, grid, camera = scene.camera,
         stop = figure_->stop.get_token()]() -> Result<Message> {
            try {
                if (turn.frames == 0) {
                    PALPATE_TRY(draw(camera, path.string()));
                    return written(path);
                }
                PALPATE_TRY(draw_turntable(turn, camera, grid, path.string(), draw, stop));
            } catch (const std::future_error&) { // the thread of pictures has ended
                return fail("the figure was given up");
            } catch (const std::exception& error) {
                return fail("{}: {}", path.string(), failure_text(error));
            }
            return fmt::format("{} pictures written: ", turn.frames) +
                   Message::name(std::filesystem::absolute(path).string());
        });
    work_->tell(turn.frames == 0 ? "drawing the figure .."
                                 : fmt::format("drawing {} pictures ..", turn.frames));
}

void Viewer::follow_figure() {
    state_.figure.share.reset();
    if (!figure_)
        return;
    if (figure_->written.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
        const Result<Message> told = figure_->written.get();
        work_->tell(told ? *told : Message::why(told.error()));
        figure_.reset();
    } else {
        state_.figure.share = static_cast<double>(figure_->drawn) / figure_->pictures;
    }
}

void Viewer::end_figure() {
    if (!figure_)
        return;
    figure_->stop.request_stop();
    figure_->written.wait();
    figure_.reset();
}

} // namespace palpate::view
