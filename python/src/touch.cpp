// Touch: the haptic loop with a simulated hand, and a servo whose device is the caller.

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <sstream>

#include "engine/base/option_name.h"
#include "engine/program/touch_feel.h"
#include "engine/program/touch_run.h"
#include "haptics/device/velocity.h"
#include "haptics/servo/touch_log.h"
#include "python/src/bind.h"
#include "python/src/work.h"

namespace palpate::python {

namespace {

namespace hp = palpate::haptics;

using VolumePtr = std::shared_ptr<LoadedVolume>;
using Numbers = std::map<std::string, double>;
using Texts = std::map<std::string, std::string>;
using Poses = py::array_t<double, py::array::c_style | py::array::forcecast>;

// A request for what is felt and how, in the options of `palpate touch`.
struct Asked {
    std::string algorithm = "swept-point";
    hp::TouchParameters parameters;
    FeelOptions feel;
    TouchRunSettings run;
    bool has_iso = false;
};

// Sets the setting of that keyword, of one that has an option; whether there is one.
template <class Struct>
Result<bool> take(const std::string& keyword, double value, Struct& to,
                  std::span<const Setting<Struct>> settings) {
    for (const Setting<Struct>& setting : settings) {
        const char* own = *setting.use.keyword ? setting.use.keyword : setting.use.option;
        if (!*own || text_of(Option{own}) != keyword)
            continue;
        if (!allows(setting, value))
            return fail("{}: expected {}, found {:g}", keyword, range_text(setting), value);
        set(setting, to, value);
        return true;
    }
    return false;
}

Result<Asked> asked_for(const Numbers& numbers, const Texts& texts) {
    Asked a;
    hp::TouchParameters& p = a.parameters;
    for (const auto& [name, value] : numbers) {
        PALPATE_TRY(const bool is_felt,
                    take<hp::TouchParameters>(name, value, p, hp::kTouchSettings));
        if (is_felt)
            continue;
        PALPATE_TRY(const bool is_of_feel, take<FeelOptions>(name, value, a.feel, kFeelSettings));
        PALPATE_TRY(const bool is_of_run, take<TouchRunSettings>(name, value, a.run, kRunSettings));
        if (!is_of_feel && !is_of_run)
            return fail("{}: expected an option of touch", name);
    }
    const std::pair<const char*, std::string*> words[] = {
        {"algorithm", &a.algorithm},
        {"source", &a.feel.source},
        {"mesh", &a.feel.mesh},
        {"felt_tool", &a.feel.felt_tool},
        {"tool", &a.feel.tool},
        {"edit", &a.feel.edit},
        {"transfer", &a.feel.transfer},
        {"opacity", &a.feel.opacity},
        {"transfer_across", &a.feel.transfer_across}};
    for (const auto& [name, value] : texts) {
        if (name == "label_feel") { // apart by semicolons
            std::istringstream rest(value);
            for (std::string one; std::getline(rest, one, ';');)
                a.feel.label_feel.push_back(one);
            continue;
        }
        const auto entry = std::find_if(std::begin(words), std::end(words),
                                        [&, n = name](const auto& k) { return k.first == n; });
        if (entry == std::end(words))
            return fail("{}: expected an option of touch", name);
        *entry->second = value;
    }
    a.has_iso = numbers.contains("iso");
    if (!numbers.contains("friction_dynamic"))
        p.friction_dynamic = p.friction_static;
    if (p.friction_dynamic > p.friction_static)
        return fail("friction_dynamic: expected at most friction, {:g}, found {:g}",
                    p.friction_static, p.friction_dynamic);
    if (!a.feel.source.empty() && a.feel.source != "grey" && a.feel.source != "labels")
        return fail("source: expected grey or labels, found '{}'", a.feel.source);
    if (!hp::find_algorithm(a.algorithm)) {
        std::string names;
        for (const hp::AlgorithmEntry& entry : hp::algorithms())
            names += fmt::format("{}{}", names.empty() ? "" : ", ", entry.name);
        return fail("algorithm: expected one of {}, found '{}'", names, a.algorithm);
    }
    PALPATE_TRY(check_together(a.feel, a.algorithm));
    return a;
}

Result<Feel> feel_of(const Asked& asked, const LoadedVolume& volume, const VolumePtr& labels,
                     const std::stop_token& stop) {
    LoadedScene scene{{volume.volume, {}, {}}, volume.modality, {}, {}, {}, {}};
    if (labels)
        scene.data.labels = labels->volume;
    hp::TouchParameters parameters = asked.parameters;
    if (!asked.has_iso)
        parameters.iso = default_iso(scene);
    return make_feel(asked.feel, scene, parameters, *hp::find_algorithm(asked.algorithm), stop);
}

// Rows of time_s, x, y, z; then buttons; then qw, qx, qy, qz.
Result<hp::HandPath> path_of(const Poses& rows) {
    const py::ssize_t columns = rows.ndim() == 2 ? rows.shape(1) : 0;
    if (columns != 4 && columns != 5 && columns != 9)
        return fail(
            "path: expected rows of time_s, x, y, z, and optionally buttons, and qw, qx, qy, qz; "
            "found an array of {} columns",
            columns);
    std::vector<hp::HandPose> poses;
    for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
        const double* row = rows.data(i, 0);
        hp::HandPose pose;
        pose.time_s = row[0];
        pose.tool.position_mm = {row[1], row[2], row[3]};
        if (columns > 4) {
            if (!(row[4] >= 0.0 && row[4] < 4294967296.0 && row[4] == std::floor(row[4])))
                return fail("path: row {}: expected buttons as a whole number, found {:g}", i,
                            row[4]);
            pose.buttons = static_cast<uint32_t>(row[4]);
        }
        if (columns == 9) {
            const glm::dquat q(row[5], row[6], row[7], row[8]);
            if (!(glm::length(q) > 1e-6 && std::isfinite(glm::length(q))))
                return fail("path: row {}: expected a rotation, found a quaternion near 0", i);
            pose.tool.rotation = glm::normalize(q);
        }
        poses.push_back(pose);
    }
    if (poses.empty())
        return fail("path: expected a pose at least, found none");
    if (poses.back().time_s - poses.front().time_s > 3600.0)
        return fail("path: expected at most an hour, found {:g} s",
                    poses.back().time_s - poses.front().time_s);
    return hp::make_hand_path(std::move(poses));
}

// An array of a value of each tick.
template <class T, class Value>
py::array_t<T> column(std::span<const hp::ServoTick> ticks, const Value& value) {
    py::array_t<T> out(static_cast<py::ssize_t>(ticks.size()));
    std::transform(ticks.begin(), ticks.end(), out.mutable_data(), value);
    return out;
}
template <class Value>
py::array_t<double> vectors(std::span<const hp::ServoTick> ticks, const Value& value) {
    py::array_t<double> out({static_cast<py::ssize_t>(ticks.size()), py::ssize_t{3}});
    double* to = out.mutable_data();
    for (const hp::ServoTick& tick : ticks) {
        const glm::dvec3 v = value(tick);
        for (int a = 0; a < 3; ++a)
            *to++ = v[a];
    }
    return out;
}

py::dict touched(const LoadedVolume& volume, const VolumePtr& labels, const Poses& rows,
                 const std::string& device_name, const Numbers& numbers, const Texts& texts,
                 const py::object& progress) {
    const hp::HandPath path = value_of(path_of(rows));
    TouchRun run = python::run<TouchRun>(progress, [&](const Report& report) -> Result<TouchRun> {
        PALPATE_TRY(const Asked asked, asked_for(numbers, texts));
        PALPATE_TRY(const hp::DeviceEntry device, hp::find_device(device_name));
        if (!device.node.empty())
            return fail("device: expected a simulated device, found {}, which a person moves",
                        device_name);
        PALPATE_TRY(Feel feel, feel_of(asked, volume, labels, report.stop));
        SessionSetup session = session_setup(feel);
        return run_touch_loop({.session = std::move(session),
                               .edit = std::move(feel.edit),
                               .algorithm = *hp::find_algorithm(asked.algorithm),
                               .path = path,
                               .device = device,
                               .settings = asked.run},
                              report.stop, report.progress);
    });
    const auto first =
        std::find_if(run.ticks.begin(), run.ticks.end(),
                     [&](const hp::ServoTick& t) { return t.now_ns >= run.start_ns; });
    const std::span<const hp::ServoTick> ticks(first, run.ticks.end());
    const hp::TouchSummary sum = hp::summarise(run.ticks, run.start_ns);
    py::dict out;
    out["time_s"] = column<double>(
        ticks, [&](const auto& t) { return double(t.now_ns - run.start_ns) * 1e-9; });
    out["tool"] = vectors(ticks, [](const auto& t) { return t.tool.position_mm; });
    out["proxy"] = vectors(ticks, [](const auto& t) { return t.touched.proxy.position_mm; });
    out["force"] = vectors(ticks, [](const auto& t) { return t.sent_world_n; });
    out["normal"] = vectors(ticks, [](const auto& t) { return t.touched.normal; });
    out["depth"] = column<double>(ticks, [](const auto& t) { return t.touched.depth_mm; });
    out["energy"] = column<double>(ticks, [](const auto& t) { return t.energy_mj; });
    out["contact"] =
        column<uint8_t>(ticks, [](const auto& t) { return uint8_t(t.touched.contact); });
    out["label"] = column<uint32_t>(ticks, [](const auto& t) { return t.touched.label; });
    out["buttons"] = column<uint32_t>(ticks, [](const auto& t) { return t.buttons; });
    out["faults"] = column<uint32_t>(ticks, [](const auto& t) { return t.faults; });
    out["volume"] = std::make_shared<LoadedVolume>(
        LoadedVolume{std::move(run.volume), {}, {}, volume.modality, {}, {}});
    out["strokes"] = run.strokes;
    out["fault_names"] = hp::fault_text(sum.faults);
    return out;
}

struct DeviceSize {
    double reach_mm, max_force_n;
};
// clang-format off
constexpr Setting<DeviceSize> kDeviceSettings[] = {
    {"reach", &DeviceSize::reach_mm, 1e-3, 1e4, "mm", "Half of the device's workspace on each axis"},
    {"max_force", &DeviceSize::max_force_n, 1e-3, 1e3, "N", "What the device can exert"},
};
// clang-format on

// A device whose hand is the caller of tick().
class CallersDevice final : public hp::HapticDevice {
 public:
    CallersDevice(const DeviceSize& size, double rate_hz) {
        value_of(check_settings<DeviceSize>("Servo", size, kDeviceSettings));
        capabilities_.name = "Python";
        capabilities_.workspace_m = glm::dvec3(size.reach_mm * 1e-3);
        capabilities_.max_force_n = size.max_force_n;
        capabilities_.rate_hz = rate_hz;
        capabilities_.buttons = 31;
    }
    const hp::DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    hp::DeviceStatus read(int64_t, hp::DeviceSample& sample) noexcept override {
        sample = next;
        return hp::DeviceStatus::ok;
    }
    hp::DeviceStatus write(int64_t, const hp::Wrench& wrench) noexcept override {
        written = wrench;
        return hp::DeviceStatus::ok;
    }
    void halt(int64_t) noexcept override { written = {}; }

    hp::DeviceSample next;
    hp::Wrench written;

 private:
    hp::DeviceCapabilities capabilities_;
};

class CallersServo {
 public:
    CallersServo(const LoadedVolume& volume, const VolumePtr& labels,
                 const std::array<double, 3>& center_mm, const DeviceSize& size,
                 const Numbers& numbers, const Texts& texts)
        : asked_(value_of(asked_for(numbers, texts))), device_(size, asked_.run.rate_hz) {
        run<void>(py::none(), [&](const Report& report) -> Result<void> {
            PALPATE_TRY(const Feel feel, feel_of(asked_, volume, labels, report.stop));
            if (feel.edit)
                return fail("edit, drill: a Servo cuts nothing; touch() does");
            const hp::AlgorithmEntry& entry = *hp::find_algorithm(asked_.algorithm);
            algorithm_ = entry.make();
            scenes_.emplace(std::make_unique<const hp::TouchScene>(feel.scene));
            parameters_.emplace(std::make_unique<const hp::TouchParameters>(feel.parameters));
            const hp::Workspace workspace({center_mm[0], center_mm[1], center_mm[2]},
                                          asked_.run.scale > 0.0 ? asked_.run.scale : 1.0);
            hp::Servo::Options options;
            options.rate_hz = asked_.run.rate_hz;
            servo_.emplace(hp::Servo::Parts{device_, *algorithm_, *scenes_, *parameters_},
                           workspace, options);
            servo_->arm();
            return {};
        });
    }

    py::dict tick(double time_s, const std::array<double, 3>& position_mm, uint32_t buttons) {
        const std::lock_guard lock(mutex_);
        if (!(time_s >= 0.0 && time_s < 1e9))
            throw Failure(fmt::format("time: expected 0 s or more, found {:g}", time_s));
        const auto now_ns = static_cast<int64_t>(std::llround(time_s * 1e9));
        if (has_last_ && now_ns <= last_ns_)
            throw Failure(fmt::format("time: expected more than {:g} s, found {:g}",
                                      double(last_ns_) * 1e-9, time_s));
        const glm::dvec3 position =
            1e-3 * glm::dvec3(position_mm[0], position_mm[1], position_mm[2]);
        for (int a = 0; a < 3; ++a)
            if (!std::isfinite(position[a]))
                throw Failure("position: expected three finite numbers");
        device_.next.velocity_m_per_s =
            has_last_ ? velocity_.add(position, double(now_ns - last_ns_) * 1e-9)
                      : velocity_.add(position, 1.0 / asked_.run.rate_hz);
        device_.next.time_ns = last_ns_ = now_ns;
        device_.next.position_m = position;
        device_.next.buttons = buttons;
        has_last_ = true;
        const hp::ServoTick tick = servo_->tick(now_ns, now_ns);
        const auto list = [](glm::dvec3 v) { return std::array{v.x, v.y, v.z}; };
        py::dict out;
        out["force"] = list(device_.written.force_n);
        out["tool"] = list(tick.tool.position_mm);
        out["proxy"] = list(tick.touched.proxy.position_mm);
        out["depth"] = tick.touched.depth_mm;
        out["contact"] = uint32_t(tick.touched.contact);
        out["share"] = tick.share;
        out["faults"] = hp::fault_text(tick.faults);
        return out;
    }

    void arm() {
        const std::lock_guard lock(mutex_);
        servo_->arm();
    }

 private:
    std::mutex mutex_;
    Asked asked_;
    CallersDevice device_;
    std::unique_ptr<hp::Algorithm> algorithm_;
    std::optional<Mailbox<hp::TouchScene>> scenes_;
    std::optional<Mailbox<hp::TouchParameters>> parameters_;
    std::optional<hp::Servo> servo_;
    hp::VelocityEstimator velocity_;
    int64_t last_ns_ = 0;
    bool has_last_ = false;
};

} // namespace

void bind_touch(py::module_& module) {
    module.def("touch", touched);
    module.def("touch_algorithms", [] {
        std::vector<std::string> names;
        for (const hp::AlgorithmEntry& entry : hp::algorithms())
            names.emplace_back(entry.name);
        return names;
    });
    module.def("touch_devices", [] {
        std::vector<std::string> names;
        for (const hp::DevicePreset& preset : hp::device_presets())
            names.emplace_back(preset.name);
        return names;
    });
    py::class_<CallersServo>(module, "Servo")
        .def(py::init([](const LoadedVolume& volume, const VolumePtr& labels,
                         const std::array<double, 3>& center_mm, double reach_mm, double force_n,
                         const Numbers& numbers, const Texts& texts) {
            return std::make_unique<CallersServo>(volume, labels, center_mm,
                                                  DeviceSize{reach_mm, force_n}, numbers, texts);
        }))
        .def("tick", &CallersServo::tick)
        .def("arm", &CallersServo::arm);
}

} // namespace palpate::python
