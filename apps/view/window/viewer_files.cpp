// The part of the viewer that leaves and writes files.

#include <algorithm>
#include <filesystem>

#include "apps/view/document/free_name.h"
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
    else {
        saved_ = work_->saving().saved_text();
        leave();
    }
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
    follow_file_preview();
}

// One picture at a time, of the file that is pointed at: the one that was kept when it was opened,
// else one of the file itself, if reading it is no work of minutes.
void Viewer::follow_file_preview() {
    interface_->show_file_preview(&file_preview_);
    const std::string& path = state_.pointed_file;
    if (path.empty() || !options_.open_beside) {
        if (!state_.browser_open)
            file_preview_ = {};
    } else if (path != file_preview_.path) {
        file_preview_ = {}; // ends the reading of the one before
        const auto make = [small = options_.small_picture, read = options_.open_beside, path](
                              size_t,
                              const std::stop_token& stop) -> Result<std::vector<std::byte>> {
            constexpr uintmax_t kMost_bytes = uintmax_t{1} << 28;
            if (small)
                if (Result<std::vector<std::byte>> known = small(path))
                    return known;
            std::error_code ignored;
            if (std::filesystem::file_size(path, ignored) > kMost_bytes)
                return fail("{}: too large for a picture in passing", path);
            PALPATE_TRY(const LoadedVolume loaded, read(path, false, stop, [](double) {}));
            return preview_of(loaded, SeriesPreviews::kSide_px);
        };
        file_preview_ = {path, std::make_unique<SeriesPreviews>(make, 1, options_.threaded)};
    }
    if (file_preview_.picture && file_preview_.picture->poll()) {
        new_file_preview_ = true;
        ++looks_;
    }
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
        state_.figure.told = told ? *told : Message::why(told.error());
        work_->tell(state_.figure.told);
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
