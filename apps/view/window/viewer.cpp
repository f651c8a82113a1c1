#include "apps/view/window/viewer.h"

#include <algorithm>
#include <new>

#include "apps/view/script/dump.h"
#include "apps/view/tools/hand_pointer.h"
#include "apps/view/tools/tool.h"
#include "apps/view/window/interaction.h"
#include "engine/base/failure.h"
#include "engine/base/log.h"
#include "engine/base/profile.h"
#include "engine/gpu/error.h"

namespace palpate::view {

Viewer::Viewer(GpuDevice& pictures, GpuDevice& interface, VkFormat format, Source source,
               glm::uvec2 size_px, double text_scale, ViewerOptions options)
    : pictures_device_(&pictures),
      interface_device_(&interface),
      format_(format),
      options_(std::move(options)),
      interface_(std::make_unique<Interface>(text_scale)),
      drawing_(std::make_unique<UiDrawing>(interface, format)),
      interface_scale_(text_scale),
      kept_(options_.settings),
      liked_scale_(kept_.text_scale),
      opening_(options_.threaded) {
    state_.size_px = size_px;
    state_.text_scale = text_scale;
    begin(std::move(source));
    state_.light = kept_.light;
    state_.indices_shown = kept_.indices;
    state_.panel_px = kept_.panel_px;
    state_.sections = kept_.sections;
    shows_example_ = options_.asks_for_file;
    if (options_.asks_for_file) {
        state_.welcome_open = true;
        offer_files();
    }
    state_.hints = {
        .open = options_.hints && !kept_.hints_seen, .seen = kept_.hints_seen, .followed = {}};
    if (options_.recent)
        interface_->set_recent(options_.recent(""));
}

void Viewer::begin(Source source) {
    // What may fail comes before what is open goes.
    const LoadedScene& loaded = source.scene.loaded;
    Pictures::Options pictures_with = {
        .renderer = options_.renderer,
        .frame_ms = options_.frame_ms,
        .meshes = loaded.data.meshes,
        .fused = loaded.data.fused,
        .overlay = loaded.data.overlay,
        .on_picture = options_.on_picture,
        .threaded = options_.threaded,
        .stay = pictures_device_->handle() == interface_device_->handle()};
    auto work = std::make_unique<Work>(std::move(source), state_.size_px, state_.text_scale,
                                       options_.threaded);
    drop_pictures(); // before the session that they look at
    previews_.reset();
    interface_->show_previews(nullptr);
    interface_->begin_document();
    pictures_with_ = std::move(pictures_with);
    work_ = std::move(work);
    work_->hand().touch().set_up(options_.hand);
    const bool names_hidden = state_.names_hidden; // then pictures of patients are not kept either
    state_ = work_->subject().home;
    state_.recovered_steps = work_->steps_file().recovered();
    if (options_.display)
        use_profile(state_.stereo, *options_.display);
    if (options_.volume_alone) {
        state_.layout = Layout::volume;
        state_.tools_open = state_.status_open = state_.bars_open = state_.notes_shown = false;
    }
    if (!names_hidden)
        keep_small_picture(work_->path());
    if (!options_.hand.device.empty()) {
        begin_hand(state_, work_->subject());
        work_->obey(order::StartHand{}, state_);
    }
    make_pictures();
}

void Viewer::keep_small_picture(const std::string& path) {
    if (options_.keep_small_picture)
        attempt_part("small picture", [&] {
            const LoadedScene& now = work_->loaded();
            const LoadedVolume shown{now.data.volume, {}, {}, now.modality, {}, {}, now.inverted};
            options_.keep_small_picture(path, preview_of(shown, SeriesPreviews::kSide_px));
        });
}

Viewer::~Viewer() {
    opening_.cancel();
    end_figure();
}

// Letters are drawn sharp at each size: the interface is made anew.
void Viewer::follow_text_scale() {
    if (interface_scale_ == state_.text_scale)
        return;
    interface_scale_ = state_.text_scale;
    drop_pictures();
    drawing_.reset(); // waits for the device
    interface_.reset();
    interface_ = std::make_unique<Interface>(interface_scale_);
    drawing_ = std::make_unique<UiDrawing>(*interface_device_, format_);
    if (options_.recent)
        interface_->set_recent(options_.recent(""));
    interface_->show_welcome(&welcome_);
    make_pictures();
}

std::optional<std::string> Viewer::failure() {
    const auto failure = pictures_ ? pictures_->failure() : std::nullopt;
    return failure && !failure->for_lack_of_memory ? std::optional(failure->why) : std::nullopt;
}

template <class Do>
bool Viewer::attempt_part(const std::string& what, Do&& act) {
    try {
        act();
        return true;
    } catch (const GpuError&) {
        throw;
    } catch (const std::exception& error) { // memory that ran out, samples that cannot be read
        const std::string told = fmt::format("{}: {}", what, failure_text(error));
        constexpr double kAgain_s = 10.0; // what fails in each frame
        if (told != last_failure_ || time_s_ > failed_s_ + kAgain_s) {
            log::error("{}", told);
            work_->tell(what + ": " + Message::why({failure_text(error)}));
            last_failure_ = told;
            failed_s_ = time_s_;
        }
        return false;
    }
}

bool Viewer::has_all() {
    constexpr double kAgain_s = 1.0;
    attempt_part("window", [&] {
        if (!interface_)
            interface_ = std::make_unique<Interface>(interface_scale_);
        if (!drawing_)
            drawing_ = std::make_unique<UiDrawing>(*interface_device_, format_);
    });
    if (pictures_)
        if (const auto failure = pictures_->failure(); failure && failure->for_lack_of_memory) {
            work_->tell("pictures: " + failure->why); // of memory
            drop_pictures();                          // what was being drawn is in no known state
            pictures_failed_s_ = time_s_;
        }
    if (!pictures_ && time_s_ >= pictures_failed_s_ + kAgain_s)
        attempt_part("pictures", [&] {
            pictures_failed_s_ = time_s_;
            make_pictures();
        });
    return interface_ && drawing_;
}

void Viewer::obey(const Order& order, bool& wants_picture) {
    const Overloaded each{
        [&](const order::Open& file) { ask_to_leave({.path = file.path, .series = file.series}); },
        [&](order::OpenRead) {
            if (!label_map_ || !state_.file_question)
                return;
            const std::string path = state_.file_question->path; // the state begins anew
            show_opened(*std::exchange(label_map_, {}), path);
        },
        [&](order::OpenLast) { open_last(); },
        [&](const order::OpenLabels& file) { open_beside(file.path, true); },
        [&](const order::OpenFused& file) { open_beside(file.path, false); },
        [&](order::CancelOpening) { opening_.cancel(); },
        [&](order::Close) { ask_to_leave({.closes = true}); },
        [&](order::Leave) {
            if (state_.leaving)
                leave();
        },
        [&](order::TakePicture) { wants_picture = true; }, // with this frame's interface
        [&](const order::PrintFigure& file) { print_figure(file.path); },
        [&](order::StopFigure) {
            if (figure_)
                figure_->stop.request_stop();
        },
        [&](const order::RecordScript& asked) { script_order_ = asked; },
        [&](const order::PlayScript& asked) { script_order_ = asked; },
        [&](const order::StopScript& asked) { script_order_ = asked; },
        [&](const order::Save& asked) { save(asked); },
        [&](const DocumentOrder& other) { work_->obey(other, state_); },
    };
    attempt_part(name_of(order), [&] { std::visit(each, order); });
}

void Viewer::follow_work() {
    attempt_part("hand", [&] { work_->hand().follow(state_, time_s_); });
    attempt_part("result", [&] { work_->poll(); });
    attempt_part("saving", [&] {
        ask_where_again();
        leave_when_saved();
        if (const std::string made = work_->saving().take_new_project();
            !made.empty() && options_.recent) {
            interface_->set_recent(options_.recent(made));
            if (!state_.names_hidden)
                keep_small_picture(made);
        }
    });
    attempt_part("notes", [&] {
        work_->follow_notes(state_,
                            state_.drag || state_.stylus.buttons != 0 || interface_->is_busy());
    });
    attempt_part("measures", [&] { work_->watch(state_); });
    attempt_part("previews", [&] { follow_previews(); });
}

void Viewer::frame(std::vector<Event> events, double time_s) {
    const profile::Scope scope("frame");
    time_s_ = time_s;
    if (!has_all())
        return;
    std::vector<Order> orders;
    // A state that an event has not brought about whole is the one before it.
    const auto take = [&](const Event& event) {
        Outcome next = after(state_, event, work_->subject());
        state_ = std::move(next.state);
        for (Order& order : next.orders)
            orders.push_back(std::move(order));
    };
    // Whether a move is a widget's is known a frame late: the one that left it is the view's, too.
    const Event still{.kind = Event::Kind::move, .time_s = time_s, .at_px = state_.pointer_px};
    if (over_widget_ && !state_.drag && !interface_->takes(still)) {
        over_widget_ = false;
        attempt_part("pointer", [&] { state_ = after(state_, still, work_->subject()).state; });
    }
    for (Event& event : events) {
        event.for_widget = !state_.drag && interface_->takes(event);
        if (event.kind == Event::Kind::move)
            over_widget_ = event.for_widget;
        attempt_part(std::string(state_.tool->name), [&] { take(event); });
    }
    bool wants_picture = false;
    for (const Order& order : orders)
        obey(order, wants_picture);
    attempt_part("opening", [&] { poll_opening(); });
    attempt_part("text size", [&] { follow_text_scale(); });
    if (!has_all())
        return;
    attempt_part("figure", [&] { follow_figure(); });
    attempt_part("pictures", [&] { take_pictures(); });
    follow_work();
    attempt_part("panels", [&] {
        orders = interface_->frame(events, time_s, state_, *work_, state_of_pictures_);
        for (const Order& order : orders)
            obey(order, wants_picture);
    });
    if (std::exchange(state_.hand_put_down, false) && state_.stylus.on) {
        obey(order::StopHand{}, wants_picture);
        work_->tell(fmt::format("the hand is stopped; the mouse has: {}", state_.tool->name));
    }
    attempt_part("settings", [&] { keep_settings(); });
    attempt_part("view", [&] { work_->show_as_wanted(state_); });
    if (!options_.threaded)
        attempt_part("document", [&] { work_->session().settle(); });
    attempt_part("pictures", [&] {
        if (pictures_)
            wish();
        if (wants_picture)
            save_picture();
    });
}

// Not while the panel's edge is dragged.
void Viewer::keep_settings() {
    if (state_.text_scale != interface_scale_)
        liked_scale_ = state_.text_scale;
    const Settings now{state_.light,    liked_scale_,         state_.panel_px,
                       state_.sections, state_.indices_shown, state_.hints.seen};
    if (now == kept_ || interface_->is_busy())
        return;
    kept_ = now;
    if (options_.keep_settings)
        options_.keep_settings(now);
}

uint64_t Viewer::looks() {
    if (!interface_)
        return looks_;
    UiTiles seen = tiles_of(interface_->lists());
    if (seen != tiles_seen_)
        ++looks_;
    tiles_seen_ = std::move(seen);
    return looks_;
}

void Viewer::record(Commands& commands, UiTarget& target) {
    if (!interface_ || !drawing_)
        return;
    const bool is_whole = attempt_part("window", [&] {
        for (Picture& picture : new_pictures_) {
            const uint32_t number = Interface::texture_of(picture.panel);
            if (!picture.image) {
                drawing_->set_picture(commands, number, picture.size_px, picture.rgba);
                continue;
            }
            commands.wait_for(picture.ready);
            drawing_->set_picture(number, std::move(picture.image));
        }
        if (previews_ && (std::exchange(new_previews_, false) ||
                          !drawing_->has_picture(Interface::kPreviewsTexture)))
            drawing_->set_picture(commands, Interface::kPreviewsTexture, previews_->size_px(),
                                  previews_->rgba());
        if (welcome_.pictures && state_.welcome_open &&
            (std::exchange(new_welcome_, false) ||
             !drawing_->has_picture(Interface::kWelcomeTexture)))
            drawing_->set_picture(commands, Interface::kWelcomeTexture,
                                  welcome_.pictures->size_px(), welcome_.pictures->rgba());
        if (file_preview_.picture && (std::exchange(new_file_preview_, false) ||
                                      !drawing_->has_picture(Interface::kFileTexture)))
            drawing_->set_picture(commands, Interface::kFileTexture,
                                  file_preview_.picture->size_px(), file_preview_.picture->rgba());
        drawing_->record(commands, target, interface_->lists());
    });
    new_pictures_.clear();
    if (is_whole)
        return;
    drawing_->forget(); // and all of it once more
    ++looks_;
}

Json Viewer::dump() {
    Json json = dump_of(*work_, state_);
    json["message"] = interface_->message();
    json["widgets"] = Json::object();
    for (const auto& [id, box] : interface_->widgets())
        json["widgets"][id] = {box.low_px.x, box.low_px.y, box.size_px.x, box.size_px.y};
    return json;
}

} // namespace palpate::view
