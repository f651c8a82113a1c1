#include "apps/palpate/view/viewer.h"

#include <algorithm>
#include <filesystem>

#include "apps/palpate/view/hand_pointer.h"
#include "apps/palpate/view/interaction.h"
#include "engine/base/log.h"
#include "engine/base/memory.h"
#include "engine/base/profile.h"
#include "engine/image/png.h"

namespace palpate::view {

namespace {

// "NAME-N.png" from the number on, or "NAME.png" for 0: the first that replaces no picture.
std::filesystem::path free_name(const std::filesystem::path& name, uint32_t number) {
    std::filesystem::path path = name;
    do {
        if (number > 0)
            path.replace_filename(
                fmt::format("{}-{}{}", name.stem().string(), number, name.extension().string()));
        ++number;
    } while (std::filesystem::exists(path));
    return path;
}

std::string written(const std::filesystem::path& path) {
    return fmt::format("picture written: {}", std::filesystem::absolute(path).string());
}

} // namespace

Viewer::Viewer(GpuDevice& pictures, GpuDevice& interface, VkFormat format, Source source,
               glm::uvec2 size_px, double text_scale, ViewerOptions options)
    : pictures_device_(&pictures),
      interface_device_(&interface),
      format_(format),
      options_(std::move(options)),
      interface_(std::make_unique<Interface>(text_scale)),
      drawing_(std::make_unique<UiDrawing>(interface, format)),
      interface_scale_(text_scale) {
    state_.size_px = size_px;
    state_.text_scale = text_scale;
    begin(std::move(source));
    state_.light = options_.light;
    if (options_.asks_for_file) {
        state_.browser_open = true;
        state_.tab = Tab::file;
        work_->tell("this is a phantom to try tools on; open a file, or a folder of DICOM files");
    }
    if (options_.recent)
        interface_->set_recent(options_.recent(""));
}

void Viewer::begin(Source source) {
    new_pictures_.clear();
    drawing_->drop_pictures();
    pictures_.reset(); // before the session that it looks at
    pictures_with_ = {.renderer = options_.renderer,
                      .frame_ms = options_.frame_ms,
                      .meshes = source.scene.loaded.data.meshes,
                      .fused = source.scene.loaded.data.fused,
                      .overlay = source.scene.loaded.data.overlay,
                      .on_picture = options_.on_picture,
                      .threaded = options_.threaded,
                      .stay = pictures_device_->handle() == interface_device_->handle()};
    work_ = std::make_unique<Work>(std::move(source), state_.size_px, state_.text_scale,
                                   options_.threaded);
    work_->touch().set_up(options_.hand);
    state_ = work_->subject().home;
    if (options_.display)
        use_profile(state_.stereo, *options_.display);
    if (options_.volume_alone) {
        state_.layout = Layout::volume;
        state_.tools_open = state_.status_open = state_.notes_shown = false;
    }
    if (!options_.hand.device.empty()) {
        begin_hand(state_, work_->subject());
        work_->obey({Order::Kind::hand_start, {}, 0.0, {}}, state_);
    }
    make_pictures();
}

void Viewer::make_pictures() {
    state_of_pictures_ = {};
    pictures_ = std::make_unique<Pictures>(*pictures_device_, work_->session(), pictures_with_);
}

Viewer::~Viewer() {
    stop_opening_.request_stop();
}

void Viewer::open(const std::string& path, const std::string& series) {
    if (!options_.open || opening_.valid())
        return;
    stop_opening_ = std::stop_source();
    state_.opening = path;
    state_.opening_since_s = time_s_;
    opening_ = std::async(options_.threaded ? std::launch::async : std::launch::deferred,
                          [open = options_.open, path, series, stop = stop_opening_.get_token()] {
                              return open(path, series, stop);
                          });
    if (!options_.threaded)
        take_opened(opening_.get());
}

void Viewer::open_unless_edits_are_lost(const Order& order) {
    const std::string asked = order.path + "\n" + order.series;
    if (work_->closing_loses_steps() && asked != asked_to_open_) {
        asked_to_open_ = asked;
        work_->tell(
            "There are edits that are not saved: Ctrl+S saves them, opening again loses them.");
        return;
    }
    open(order.path, order.series);
}

void Viewer::poll_opening() {
    if (opening_.valid() && opening_.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
        take_opened(opening_.get());
}

void Viewer::take_opened(Result<Source> opened) {
    const std::string path = std::exchange(state_.opening, {});
    asked_to_open_.clear();
    if (!opened) {
        const bool cancelled = stop_opening_.stop_requested();
        if (!cancelled)
            log::error("{}", opened.error().message);
        work_->tell(cancelled ? "opening was cancelled" : opened.error().message);
        return;
    }
    const ViewState before = state_;
    begin(std::move(*opened));
    return_free_memory_now(); // of the document that was open
    state_.names_hidden = before.names_hidden;
    state_.light = before.light;
    state_.text_scale = before.text_scale;
    state_.tab = before.tab;
    if (options_.recent)
        interface_->set_recent(options_.recent(path));
}

// Letters are drawn sharp at each size: the interface is made anew.
void Viewer::follow_text_scale() {
    if (interface_scale_ == state_.text_scale)
        return;
    interface_scale_ = state_.text_scale;
    new_pictures_.clear();
    drawing_->drop_pictures();
    pictures_.reset();
    drawing_.reset(); // waits for the device
    interface_.reset();
    interface_ = std::make_unique<Interface>(interface_scale_);
    drawing_ = std::make_unique<UiDrawing>(*interface_device_, format_);
    if (options_.recent)
        interface_->set_recent(options_.recent(""));
    make_pictures();
}

void Viewer::frame(std::vector<Event> events, double time_s) {
    const profile::Scope scope("frame");
    time_s_ = time_s;
    std::vector<Order> orders;
    for (Event& event : events) {
        event.for_widget = !state_.drag && interface_->takes(event);
        Outcome next = after(std::move(state_), event, work_->subject());
        state_ = std::move(next.state);
        for (Order& order : next.orders)
            orders.push_back(std::move(order));
    }
    bool wants_picture = false;
    const auto obey = [&](const std::vector<Order>& all) {
        for (const Order& order : all)
            if (order.kind == Order::Kind::open)
                open_unless_edits_are_lost(order);
            else if (order.kind == Order::Kind::picture)
                wants_picture = true; // with this frame's interface
            else if (order.kind == Order::Kind::figure)
                print_figure(order.path);
            else if (order.kind == Order::Kind::cancel_opening)
                stop_opening_.request_stop();
            else if (order.kind == Order::Kind::save && order.path.empty() && !work_->has_project())
                state_.saving_open = true; // asks where
            else
                work_->obey(order, state_);
    };
    obey(orders);
    poll_opening();
    follow_text_scale();
    if (const auto printed = pictures_->take_printed())
        work_->tell(*printed ? written(**printed) : printed->error().message);
    for (Picture& picture : pictures_->take()) {
        ++looks_;
        if (saw_picture)
            saw_picture(picture);
        new_pictures_.push_back(std::move(picture));
    }
    for (const Picture& picture : new_pictures_)
        state_of_pictures_[static_cast<size_t>(picture.panel)] = {
            true, picture.complete, picture.ms, picture.error_estimate};
    work_->follow_hand(state_, time_s);
    work_->poll();
    if (const std::string made = work_->take_new_project(); !made.empty() && options_.recent)
        interface_->set_recent(options_.recent(made));
    work_->watch(state_);
    const Settings before{state_.light, state_.text_scale};
    obey(interface_->frame(events, time_s, state_, *work_, state_of_pictures_));
    if (const Settings now{state_.light, state_.text_scale};
        options_.keep_settings && now != before)
        options_.keep_settings(now);
    work_->show_as_wanted(state_);
    if (!options_.threaded)
        work_->session().settle();
    wish();
    if (wants_picture)
        save_picture();
}

bool Viewer::may_close() {
    if (!work_->closing_loses_steps() || state_.closing_open)
        return true; // asked twice
    state_.closing_open = true;
    return false;
}

void Viewer::wish() {
    std::vector<Pictures::Wish> wishes;
    // A brush in the hand: the first stroke shall not wait for rays of another kind.
    const bool has_labels = work_->has_labels() || state_.hand == Hand::draw;
    for (const Places::View& view : places_of(state_).views)
        wishes.push_back({view.panel,
                          scene_of(state_, work_->subject().grid, view.panel,
                                   work_->session().scene(), has_labels),
                          display_of(state_, view.panel, screen_px_)});
    for (Pictures::Wish& wish : wishes) // the hand's tool lies among the rays, at its depth
        for (const Work::HandSurface& surface : work_->hand_surfaces(state_))
            if (wish.panel == Panel::volume && wish.scene.surfaces.size() < kMaxSurfaces) {
                wish.scene.surfaces.push_back(surface.layer);
                wish.meshes.push_back(surface.mesh);
            }
    pictures_->want(std::move(wishes));
}

uint64_t Viewer::looks() {
    std::vector<std::byte> seen = drawing_of(interface_->lists());
    if (seen != drawing_seen_)
        ++looks_;
    drawing_seen_ = std::move(seen);
    return looks_;
}

void Viewer::record(Commands& commands, GpuImage& target) {
    for (Picture& picture : new_pictures_) {
        const uint32_t number = Interface::texture_of(picture.panel);
        if (!picture.image) {
            drawing_->set_picture(commands, number, picture.size_px, picture.rgba);
            continue;
        }
        commands.wait_for(picture.ready);
        drawing_->set_picture(number, std::move(picture.image));
    }
    new_pictures_.clear();
    drawing_->record(commands, target, interface_->lists());
}

Result<void> Viewer::draw_pictures() {
    PALPATE_TRY(new_pictures_, pictures_->draw());
    return {};
}

Result<Image> Viewer::shot() {
    PALPATE_TRY(draw_pictures());
    frame({}, time_s_ + kFrame_s); // the notes know of the pictures
    return capture();
}

Image Viewer::capture() {
    const glm::uvec2 size = state_.size_px;
    Commands commands(*interface_device_);
    GpuImage target(*interface_device_, "shot",
                    {.format = format_, .size = glm::uvec3(size, 1), .attachment = true});
    record(commands, target);
    const Commands::Region all{0, glm::uvec3(0), glm::uvec3(size, 1)};
    const BufferSlice texels =
        commands.read_back(target, std::span(&all, 1), uint64_t{4} * size.x * size.y);
    commands.submit();
    commands.ticket().wait();
    const bool swapped = format_ == VK_FORMAT_B8G8R8A8_UNORM || format_ == VK_FORMAT_B8G8R8A8_SRGB;
    Image image = make_image(size, {"R", "G", "B"});
    const std::byte* from = texels.mapped().data();
    for (size_t i = 0; i < size_t{size.x} * size.y; ++i)
        for (size_t c = 0; c < 3; ++c)
            image.samples[3 * i + c] =
                static_cast<float>(from[4 * i + (swapped ? 2 - c : c)]) / 255.0f;
    return image;
}

std::string Viewer::file_name() const {
    return state_.names_hidden || is_synthetic(work_->title())
               ? "palpate"
               : std::filesystem::path(work_->title()).stem().string();
}

// Of the window, in the current folder.
void Viewer::save_picture() {
    if (!options_.threaded) {
        work_->tell("a script saves nothing");
        return;
    }
    const std::filesystem::path path = free_name(file_name() + ".png", 1);
    const Result<void> saved = save_png(path, capture());
    work_->tell(saved ? written(path) : saved.error().message);
}

// Of a view, for print: without what belongs to the window alone, as the tool of a hand.
void Viewer::print_figure(const std::string& file) {
    if (!options_.threaded) {
        work_->tell("a script saves nothing");
        return;
    }
    const std::filesystem::path path(file);
    if (path.extension() != ".png") {
        work_->tell(fmt::format("expected a name ending in .png, found '{}'", file));
        return;
    }
    const FigureSetup& figure = state_.figure;
    const Grid& grid = work_->subject().grid;
    Scene scene =
        scene_of(state_, grid, figure.panel, work_->session().scene(), work_->has_labels());
    scene.size_px = glm::uvec2(figure.size_px);
    if (is_slice(figure.panel))
        scene.camera = camera_of(state_.slices[static_cast<size_t>(figure.panel)],
                                 state_.crosshair_mm, grid, figure.size_px);
    scene.background = glm::dvec3(figure.paper == Paper::white ? 1.0 : 0.0);
    const bool transparent = figure.paper == Paper::transparent;
    Figure marks{.letters = figure.letters,
                 .scale_bar = figure.scale_bar,
                 .color_bar = figure.color_bar,
                 .unit = work_->unit(),
                 .transparent = transparent};
    if (figure.note)
        marks.note = note_of(scene, grid, file_name(), work_->unit());
    pictures_->print({{figure.panel, std::move(scene), {}},
                      {.transparent = transparent, .figure = std::move(marks)},
                      free_name(path, 0)});
    work_->tell("drawing the figure ..");
}

Json Viewer::dump() {
    Json json = work_->dump(state_);
    json["widgets"] = Json::object();
    for (const auto& [id, box] : interface_->widgets())
        json["widgets"][id] = {box.low_px.x, box.low_px.y, box.size_px.x, box.size_px.y};
    return json;
}

void replay(Viewer& viewer, const Script& script) {
    constexpr uint64_t kIdle = 3; // frames after which nothing changes without events
    double time_s = 0.0;
    uint64_t frame = 0;
    for (size_t next = 0; next < script.lines.size(); ++frame) {
        frame =
            std::max(frame, script.lines[next].frame - std::min(script.lines[next].frame, kIdle));
        std::vector<Event> events;
        for (; next < script.lines.size() && script.lines[next].frame <= frame; ++next)
            events.push_back(script.lines[next].event);
        // Frames without events take their share of the time that passes.
        time_s = events.empty() ? std::min(time_s + kFrame_s, script.lines[next].event.time_s)
                                : events.back().time_s;
        viewer.frame(std::move(events), time_s);
    }
    for (int i = 1; i <= 2; ++i) // widgets answer in the frame after a release
        viewer.frame({}, time_s + i * kFrame_s);
}

} // namespace palpate::view
