#include "engine/session/session.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/session/feel.h"

namespace palpate {

using haptics::TouchParameters;

Session::Session(SessionSetup setup)
    : threaded_(setup.edit.threaded),
      kept_(std::move(setup.kept)),
      editor_(setup.document, std::move(setup.edit)),
      sources_(std::make_unique<const SessionSources>(
          SessionSources{std::move(setup.grey), std::move(setup.labels), std::move(setup.touch)})),
      scenes_(std::make_unique<const Scene>(std::move(setup.scene))),
      parameters_(std::make_unique<const TouchParameters>(setup.parameters)),
      felt_(editor_, setup.document, sources_, parameters_, std::move(setup.felt_surface)),
      milling_(editor_, parameters_),
      device_({editor_, lag_, felt_.scenes(), parameters_, milling_.removal(),
               threaded_ ? &bridge_wake_ : nullptr}),
      surface_({editor_, sources_, choices_, lag_, settle_wake_}, setup.mesh_iso, threaded_),
      interface_states_(editor_.add_reader()),
      interface_felt_(felt_.scenes().add_reader()),
      bridge_parameters_(parameters_.add_reader()),
      bridge_edits_(editor_.followers().add(bridge_wake_)),
      bridge_choices_(choices_.add(bridge_wake_)),
      settle_edits_(editor_.followers().add(settle_wake_)) {
    if (threaded_)
        bridge_thread_ = std::jthread([this](const std::stop_token& stop) { bridge(stop); });
}

Session::~Session() {
    stop();
}

bool Session::use(EditSetup setup, uint8_t tool) {
    Operation& operation = setup.operation;
    const std::string on = setup.on.empty() ? state().document.volumes.front().name : setup.on;
    if (operation.smooth_walls() && !operation.surface_value && on == sources_.latest().grey)
        operation.surface_value = parameters_.latest().iso;
    if (!editor_.use(std::move(setup), tool))
        return false;
    device_.let_carve(tool, true);
    return true;
}

Result<JournalChange> Session::change_journal(Journal journal, std::optional<Document> from) {
    if (!threaded_ && device_.is_down())
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
    choices_.wake();
}

void Session::align_workspace(const Camera& camera) {
    const View view = make_view(camera, {1, 1});
    haptics::WorkspaceSettings settings = workspace();
    settings.rotation = haptics::aligned_with_view(view.right, view.up);
    move_workspace(settings);
}

void Session::feel(const TouchParameters& parameters) {
    parameters_.publish(std::make_unique<const TouchParameters>(parameters));
}

void Session::show(Scene scene) {
    scenes_.publish(std::make_unique<const Scene>(std::move(scene)));
    choices_.wake();
}

namespace {

// The surface at `from`, or else the first one, goes to a value where none is yet.
void move_surface(std::vector<IsoSurface>& isos, double from, double to) {
    const auto at = [&](double value) {
        return std::find_if(isos.begin(), isos.end(),
                            [&](const IsoSurface& iso) { return iso.value == value; });
    };
    if (isos.empty() || at(to) != isos.end())
        return;
    const auto moved = at(from);
    (moved == isos.end() ? isos.front() : *moved).value = to;
    std::sort(isos.begin(), isos.end(),
              [](const IsoSurface& a, const IsoSurface& b) { return a.value < b.value; });
}

} // namespace

void Session::set_iso(double value) {
    TouchParameters parameters = parameters_.latest();
    const double before = std::exchange(parameters.iso, value);
    feel(parameters);
    Scene scene = scenes_.latest();
    if (scene.ray_cast)
        move_surface(scene.ray_cast->isos, before, value);
    for (SurfaceLayer& surface : scene.surfaces)
        if (surface.live_iso)
            surface.live_iso = value;
    if (scene != scenes_.latest())
        show(std::move(scene));
    surface_.set_iso(static_cast<float>(value));
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

void Session::stop() {
    const bool was_running = device_.is_running();
    device_.stop();
    if (was_running && !threaded_) // time does not go on, so the meter cannot say it
        milling_.rest();
}

haptics::ServoTick Session::tick(int64_t now_ns, int64_t due_ns) {
    PALPATE_ASSERT(!threaded_);
    const haptics::ServoTick tick = device_.tick(now_ns, due_ns);
    editor_.settle();
    felt_.publish();
    milling_.measure(now_ns, device_.speed_mm_per_s());
    return tick;
}

void Session::settle() {
    if (!threaded_) {
        editor_.settle();
        felt_.publish();
        return;
    }
    const uint64_t inputs = inputs_given(), commands = editor_.commands_given();
    const auto is_done = [&] {
        const auto pin = interface_states_.pin();
        const uint64_t sources = sources_.epoch();
        return pin->inputs_done >= inputs && pin->commands_done >= commands &&
               felt_.has_reached(pin->snapshot, sources) &&
               surface_.has_reached(pin->snapshot, sources);
    };
    while (!is_done())
        settle_wake_.wait();
}

EditState Session::state() {
    return *interface_states_.pin();
}

haptics::TouchScene Session::felt() {
    return *interface_felt_.pin();
}

Session::Eye::Eye(Session& session, Wake* wake)
    : session_(&session),
      states_(session.editor_.add_reader()),
      scenes_(session.scenes_.add_reader()),
      sources_(session.sources_.add_reader()) {
    if (wake) {
        edits_.emplace(session.editor_.followers().add(*wake));
        choices_.emplace(session.choices_.add(*wake));
    }
}

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

void Session::bridge(const std::stop_token& stop) {
    profile::name_thread("bridge");
    using Time = Wake::Clock::time_point;
    constexpr int64_t kAgain_ns = 10'000'000;
    while (!stop.stop_requested()) {
        int64_t due_ns = profile::now_ns() + kAgain_ns;
        try {
            if (felt_.publish())
                settle_wake_.wake();
            const int64_t now_ns = profile::now_ns();
            milling_.measure(now_ns, device_.speed_mm_per_s());
            const int64_t lock_ns = device_.lock_bricks(now_ns, felt_.felt_volume(),
                                                        bridge_parameters_.pin()->tool_radius_mm);
            due_ns = std::min(milling_.due_ns(), lock_ns);
        } catch (const std::exception&) { // memory that ran out: the same once more
        }
        bridge_wake_.wait(stop, due_ns == DeviceLink::kNever_ns
                                    ? std::nullopt
                                    : std::optional(Time(std::chrono::nanoseconds(due_ns))));
    }
}

} // namespace palpate
