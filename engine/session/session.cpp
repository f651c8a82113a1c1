#include "engine/session/session.h"

#include <malloc.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/session/feel.h"
#include "engine/surface/marching_cubes.h"
#include "haptics/core/clock.h"

namespace palpate {

namespace {

using namespace haptics;

constexpr std::chrono::microseconds kNap(200); // while nothing is to be done
constexpr int64_t kLockEvery_ms = 20;          // how often bricks round the tool are locked
constexpr double kLockReach_mm = 5.0;          // beyond the tool

std::optional<Volume> volume_of(const Document& document, const std::string& name) {
    const Volume* found = name.empty() ? nullptr : document.find(name);
    return found ? std::optional(*found) : std::nullopt;
}

bool same(const std::optional<Volume>& a, const std::optional<Volume>& b) {
    return a.has_value() == b.has_value() && (!a || a->is_same_as(*b));
}

// The version of a scene rises with each publication: algorithms know by it that a tool or a mesh
// is another. It is the snapshot, and above these bits how often sources were chosen.
constexpr int kSnapshotBits = 40;

TouchScene felt_scene(const SessionSources& sources, uint64_t chosen, const Document& document,
                      uint64_t snapshot) {
    TouchScene scene = sources.touch;
    scene.grey = volume_of(document, sources.grey);
    scene.labels = volume_of(document, sources.labels);
    scene.version = chosen << kSnapshotBits | snapshot;
    return scene;
}

} // namespace

Session::Session(SessionSetup setup)
    : threaded_(setup.edit.threaded),
      kept_(std::move(setup.kept)),
      editor_(setup.document, std::move(setup.edit)),
      sources_(std::make_unique<const SessionSources>(
          SessionSources{std::move(setup.grey), std::move(setup.labels), std::move(setup.touch)})),
      scenes_(std::make_unique<const Scene>(std::move(setup.scene))),
      felt_(
          std::make_unique<const TouchScene>(felt_scene(sources_.latest(), 0, setup.document, 0))),
      parameters_(std::make_unique<const TouchParameters>(setup.parameters)),
      workspaces_(std::make_unique<const WorkspaceSettings>()),
      interface_states_(editor_.add_reader()),
      bridge_states_(editor_.add_reader()),
      mesher_states_(editor_.add_reader()),
      interface_felt_(felt_.add_reader()),
      bridge_parameters_(parameters_.add_reader()),
      bridge_sources_(sources_.add_reader()),
      mesher_sources_(sources_.add_reader()),
      felt_surface_(std::move(setup.felt_surface)),
      felt_mesh_(sources_.latest().touch.touch_mesh),
      first_felt_mesh_(felt_mesh_),
      mesh_iso_(setup.mesh_iso.value_or(NAN)) {
    if (!threaded_)
        return;
    bridge_thread_ = std::jthread([this](const std::stop_token& stop) { bridge(stop); });
    if (setup.mesh_iso)
        mesher_thread_ = std::jthread([this](const std::stop_token& stop) { mesh_on(stop); });
}

Session::~Session() {
    stop();
    for (std::jthread* thread : {&bridge_thread_, &mesher_thread_})
        if (thread->joinable()) {
            thread->request_stop();
            thread->join();
        }
}

bool Session::use(EditSetup setup, uint8_t tool) {
    Operation& operation = setup.operation;
    const std::string on = setup.on.empty() ? state().document.volumes.front().name : setup.on;
    if (operation.smooth_walls() && !operation.surface_value && on == sources_.latest().grey)
        operation.surface_value = parameters_.latest().iso;
    if (!editor_.use(std::move(setup), tool))
        return false;
    carves_[tool].store(true, std::memory_order_release);
    return true;
}

Result<JournalChange> Session::change_journal(Journal journal, std::optional<Document> from) {
    if (!threaded_ && down_)
        return fail("expected no stroke under way, found one; lift the tool and try again");
    std::optional<JournalChange> change =
        editor_.change_journal(std::move(journal), std::move(from));
    if (!change)
        return fail("too many commands at once; try again");
    if (!threaded_)
        editor_.settle();
    return std::move(*change);
}

void Session::choose(SessionSources sources) {
    sources_.publish(std::make_unique<const SessionSources>(std::move(sources)));
}

void Session::move_workspace(const WorkspaceSettings& settings) {
    workspaces_.publish(std::make_unique<const WorkspaceSettings>(settings));
}

void Session::align_workspace(const Camera& camera) {
    const View view = make_view(camera, {1, 1});
    WorkspaceSettings settings = workspace();
    settings.rotation = aligned_with_view(view.right, view.up);
    move_workspace(settings);
}

void Session::feel(const TouchParameters& parameters) {
    parameters_.publish(std::make_unique<const TouchParameters>(parameters));
}

void Session::show(Scene scene) {
    scenes_.publish(std::make_unique<const Scene>(std::move(scene)));
}

void Session::set_iso(double value) {
    TouchParameters parameters = parameters_.latest();
    parameters.iso = value;
    feel(parameters);
    Scene scene = scenes_.latest();
    if (scene.ray_cast && !scene.ray_cast->isos.empty())
        scene.ray_cast->isos.front().value = value;
    for (SurfaceLayer& surface : scene.surfaces)
        if (surface.live_iso)
            surface.live_iso = value;
    if (scene != scenes_.latest())
        show(std::move(scene));
    if (!std::isnan(mesh_iso_.load()))
        mesh_iso_.store(static_cast<float>(value));
}

void Session::set_transfer(TransferFunction function) {
    TouchParameters parameters = parameters_.latest();
    if (parameters.opacity.point_count > 0) {
        parameters.opacity = opacity_to_touch(function);
        feel(parameters);
    }
    Scene scene = scenes_.latest();
    if (!scene.ray_cast || scene.ray_cast->transfer == function)
        return;
    scene.ray_cast->transfer = std::move(function);
    show(std::move(scene));
}

Result<void> Session::start(SessionDevice device) {
    if (running_)
        return fail("expected no device that is running, found one: stop it first");
    if (DeviceSample sample; device.device.capabilities().needs_homing &&
                             device.device.read(monotonic_ns(), sample) == DeviceStatus::not_homed)
        PALPATE_TRY(device.device.home());
    servo_thread_.reset();
    servo_.reset();
    running_ = true;
    move_workspace({device.workspace.scale(), device.workspace.rotation()});
    algorithm_ = device.algorithm.make();
    buttons_ = {device.servo.remove_button, device.servo.second_button};
    servo_ = std::make_unique<Servo>(
        Servo::Parts{device.device, *algorithm_, felt_, parameters_, threaded_ ? &stamps_ : nullptr,
                     &workspaces_, &removal_},
        device.workspace, device.servo);
    if (device.armed)
        servo_->arm();
    if (!threaded_)
        return {};
    ServoThreadOptions options;
    void* const state = dynamic_cast<void*>(algorithm_.get());
    options.memory = std::move(device.memory);
    options.memory.push_back({static_cast<const std::byte*>(state), malloc_usable_size(state)});
    options.memory.push_back(std::as_bytes(std::span(stamps_.storage())));
    options.hung = std::move(device.hung);
    options.after = [this, after = std::move(device.after)](const ServoTick& tick) {
        follow(tick);
        return !after || after(tick);
    };
    servo_thread_ = std::make_unique<ServoThread>(*servo_, std::move(options));
    return {};
}

void Session::stop() {
    if (!std::exchange(running_, false))
        return;
    if (servo_thread_)
        servo_thread_->stop();
    else
        servo_->release();
    // From here on this thread is the one that pushes.
    while (down_ && !push(EditInput::Kind::up, last_pose_)) {
        if (threaded_)
            std::this_thread::sleep_for(kNap);
        else
            editor_.settle();
    }
    if (!threaded_) { // time does not go on, so the meter cannot say it
        milling_.rate_mm3_per_s.store(0.0, std::memory_order_relaxed);
        removal_.store(0.0f, std::memory_order_relaxed);
    }
}

void Session::arm() {
    if (running_)
        servo_->arm();
}

void Session::disarm() {
    if (running_)
        servo_->disarm();
}

Result<void> Session::calibrate() {
    if (running_ || !servo_)
        return fail("expected a device that has been started and stopped, found {}",
                    running_ ? "one that is running: stop it first" : "none");
    return servo_->device().calibrate();
}

DeviceReport Session::device_report() const {
    if (!servo_)
        return {};
    const Telemetry& telemetry = servo_->telemetry();
    return {servo_->device().capabilities().name,
            running_,
            telemetry.status,
            telemetry.force,
            telemetry.faults,
            telemetry.ticks};
}

bool Session::push(EditInput::Kind kind, const StrokePose& pose, uint8_t tool) noexcept {
    const uint64_t number = pushed_.load(std::memory_order_relaxed) + 1;
    if (!editor_.push({kind, pose, number, profile::now_ns(), tool}))
        return false;
    pushed_.store(number, std::memory_order_release);
    if (const double dt_s = pose.time_s - last_pose_.time_s; down_ && dt_s > 0.0)
        speed_mm_per_s_.store(
            glm::distance(pose.tool.position_mm, last_pose_.tool.position_mm) / dt_s,
            std::memory_order_relaxed);
    down_ = kind != EditInput::Kind::up;
    last_pose_ = pose;
    return true;
}

bool Session::stroke(EditInput::Kind kind, const StrokePose& pose) {
    return !running_ && down_ == (kind != EditInput::Kind::down) && push(kind, pose);
}

ServoTick Session::tick(int64_t now_ns, int64_t due_ns) {
    PALPATE_ASSERT(!threaded_ && running_);
    const ServoTick tick = servo_->tick(now_ns, due_ns);
    follow(tick);
    editor_.settle();
    publish_felt();
    measure_milling(now_ns);
    return tick;
}

void Session::settle() {
    if (!threaded_) {
        editor_.settle();
        publish_felt();
        return;
    }
    const uint64_t inputs = pushed_, commands = editor_.commands_given();
    const auto is_done = [&] {
        const auto pin = interface_states_.pin();
        const uint64_t sources = sources_.epoch();
        return pin->inputs_done >= inputs && pin->commands_done >= commands &&
               bridged_ >= pin->snapshot && bridged_sources_ >= sources &&
               (!mesher_thread_.joinable() ||
                (meshed_ >= pin->snapshot && meshed_sources_ >= sources &&
                 meshed_iso_ == mesh_iso_));
    };
    while (!is_done())
        std::this_thread::sleep_for(kNap);
}

EditState Session::state() {
    return *interface_states_.pin();
}

TouchScene Session::felt() {
    return *interface_felt_.pin();
}

Mesh Session::mesh() {
    if (!threaded_)
        while (update_mesh()) {
        }
    const std::scoped_lock held(mesh_mutex_);
    return surface_ ? surface_->mesh() : Mesh();
}

Session::Eye::Eye(Session& session)
    : session_(&session),
      states_(session.editor_.add_reader()),
      scenes_(session.scenes_.add_reader()),
      sources_(session.sources_.add_reader()) {}

Session::Eye::Sight Session::Eye::look() {
    EditState state = *states_.pin(); // a picture takes long: nothing stays pinned meanwhile
    const auto sources = sources_.pin();
    const std::optional<Volume> grey = volume_of(state.document, sources->grey);
    SceneData data{
        grey ? *grey : state.document.first(), volume_of(state.document, sources->labels), {}};
    Scene scene = *scenes_.pin();
    data.meshes.resize(scene.surfaces.size()); // live ones have none
    data.overlay = volume_of(state.document, sources->overlay);
    data.fused = sources->fused;
    return {std::move(scene), std::move(data), std::move(state)};
}

void Session::follow(const ServoTick& tick) noexcept {
    lag_.feels(tick.scene_version & ((uint64_t{1} << kSnapshotBits) - 1));
    if (!tick.usable)
        return;
    const auto presses = [&](uint8_t tool) {
        return carves_[tool].load(std::memory_order_acquire) && buttons_[tool] < 32 &&
               (tick.buttons >> buttons_[tool] & 1);
    };
    const Carving carving = tick.touched.carving;
    const bool by_button = carving == Carving::by_button;
    if (!down_) // the button that was pressed first; where none decides, the second one chooses
        tool_ = by_button ? (presses(0) ? 0 : 1) : (presses(1) ? 1 : 0);
    const bool pressed =
        by_button ? presses(tool_)
                  : carving == Carving::at_tool && carves_[tool_].load(std::memory_order_acquire);
    if (!pressed && !down_)
        return;
    const auto kind = !down_    ? EditInput::Kind::down
                      : pressed ? EditInput::Kind::move
                                : EditInput::Kind::up;
    // By a button the tool is where it is held out of the material; the hand may be far inside.
    const glm::dvec3 at_mm = by_button ? tick.touched.proxy.position_mm : tick.tool.position_mm;
    const StrokePose pose =
        pressed ? StrokePose{1e-9 * static_cast<double>(tick.now_ns), {at_mm, tick.tool.rotation}}
                : last_pose_;
    push(kind, pose,
         tool_); // full: tried again with the next tick's pose, and the sweep leaves no gap
}

// False: nothing new.
bool Session::publish_felt() {
    const auto sources = bridge_sources_.pin();
    const auto pin = bridge_states_.pin();
    const bool chosen = sources.epoch() != bridged_sources_;
    if (pin->snapshot == bridged_ && !chosen)
        return false;
    const TouchScene& now = felt_.latest();
    TouchScene next = felt_scene(*sources, sources.epoch() - 1, pin->document, pin->snapshot);
    if (felt_surface_ && next.touch_mesh == first_felt_mesh_) {
        const std::optional<Volume>& volume =
            bridge_parameters_.pin()->source == TouchSource::labels ? next.labels : next.grey;
        if (volume && volume->version() != felt_surface_->volume().version()) {
            felt_surface_->follow(*volume);
            felt_mesh_ = felt_surface_->mesh();
        }
        next.touch_mesh = felt_mesh_;
    }
    if (chosen || !same(now.grey, next.grey) || !same(now.labels, next.labels))
        felt_.publish(std::make_unique<const TouchScene>(std::move(next)));
    bridged_ = pin->snapshot;
    bridged_sources_ = sources.epoch();
    return true;
}

void Session::measure_milling(int64_t now_ns) {
    if (now_ns - measured_ns_ < kMeasure_ms * 1'000'000)
        return;
    measured_ns_ = now_ns;
    const EditState state = *bridge_states_.pin();
    const NamedVolume& edited = state.document.volumes[state.edited];
    const bool is_labels = edited.kind == VolumeKind::labels;
    // Undo and filters change samples, too; up to the one command since the last look it was the
    // hand.
    const uint64_t commands =
        state.commands_done - std::exchange(measured_commands_, state.commands_done);
    const auto look = [&](const Volume& volume, bool by_hand) {
        return meter_.look(1e-9 * static_cast<double>(now_ns), volume,
                           is_labels ? 0.5 : bridge_parameters_.pin()->iso, is_labels, by_hand,
                           speed_mm_per_s_.load(std::memory_order_relaxed));
    };
    Milling now;
    try {
        if (commands == 1 && state.before_command)
            look(*state.before_command, true);
        now = look(edited.volume, commands == 0);
    } catch (const std::exception&) { // samples that cannot be read: the editor says so
        return;
    }
    milling_.removed_mm3.store(now.removed_mm3, std::memory_order_relaxed);
    milling_.rate_mm3_per_s.store(now.rate_mm3_per_s, std::memory_order_relaxed);
    milling_.hardness.store(now.hardness, std::memory_order_relaxed);
    removal_.store(static_cast<float>(milling_level(now)), std::memory_order_relaxed);
}

Milling Session::milling() const noexcept {
    return {milling_.removed_mm3.load(std::memory_order_relaxed),
            milling_.rate_mm3_per_s.load(std::memory_order_relaxed),
            milling_.hardness.load(std::memory_order_relaxed),
            speed_mm_per_s_.load(std::memory_order_relaxed)};
}

void Session::bridge(const std::stop_token& stop) {
    profile::name_thread("bridge");
    while (!stop.stop_requested()) {
        bool any = publish_felt();
        measure_milling(profile::now_ns());
        for (ToolStamp stamp; stamps_.pop(stamp); any = true) {
            if (stamp.time_ns / 1'000'000 % kLockEvery_ms != 0)
                continue;
            const TouchScene& felt = felt_.latest();
            const TouchParameters parameters = *bridge_parameters_.pin();
            const std::optional<Volume>& volume =
                parameters.source == TouchSource::labels ? felt.labels : felt.grey;
            if (volume)
                bricks_.update(*volume, stamp.tool.position_mm,
                               kLockReach_mm + parameters.tool_radius_mm);
        }
        if (!any)
            std::this_thread::sleep_for(kNap);
    }
}

// False: nothing new.
bool Session::update_mesh() {
    const float iso = mesh_iso_;
    if (std::isnan(iso))
        return false;
    uint64_t sources = 0; // the epoch, of this name or an earlier one
    const std::string grey = [&] {
        const auto pin = mesher_sources_.pin();
        sources = pin.epoch();
        return pin->grey;
    }();
    const EditState state = *mesher_states_.pin();
    if (meshed_sources_ == sources && meshed_ == state.snapshot && meshed_iso_ == iso)
        return false;
    const std::optional<Volume> volume = volume_of(state.document, grey);
    {
        const std::scoped_lock held(mesh_mutex_);
        const bool goes_on = volume && surface_ && surface_->iso() == iso &&
                             surface_->volume().grid() == volume->grid() &&
                             surface_->volume().type() == volume->type();
        if (!volume)
            surface_.reset();
        else if (!goes_on)
            surface_.emplace(*volume, iso);
        else if (!surface_->volume().is_same_as(*volume))
            surface_->update(*volume);
    }
    lag_.reached(EditLag::Reader::mesh, state, profile::now_ns());
    meshed_iso_ = iso;
    meshed_sources_ = sources;
    meshed_ = state.snapshot;
    return true;
}

void Session::mesh_on(const std::stop_token& stop) {
    profile::name_thread("mesher");
    while (!stop.stop_requested())
        if (!update_mesh())
            std::this_thread::sleep_for(kNap);
}

} // namespace palpate
