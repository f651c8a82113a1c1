#include "haptics/device/gamepad/gamepad.h"

#include <fcntl.h>
#include <linux/input.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <fstream>

namespace palpate::haptics {

using namespace gamepad;

bool gamepad::apply(uint16_t type, uint16_t code, int32_t value, const Ranges& ranges,
                    State& state) noexcept {
    if (type == EV_KEY && code >= kFirstButton && code < kFirstButton + 16) {
        const uint32_t bit = 1u << (code - kFirstButton);
        state.buttons = value != 0 ? state.buttons | bit : state.buttons & ~bit;
        return true;
    }
    const auto* const axis = std::find(kAxisCodes.begin(), kAxisCodes.end(), code);
    if (type != EV_ABS || axis == kAxisCodes.end())
        return false;
    const auto at = static_cast<size_t>(axis - kAxisCodes.begin());
    const Range& range = ranges[at];
    const double half = 0.5 * (double{1} * range.high - range.low);
    const double middle = range.low + half;
    const double rest = std::min(static_cast<double>(std::max(range.flat, 0)), 0.9 * half);
    const double off = std::clamp<double>(value, range.low, range.high) - middle;
    const double beyond = std::max(std::abs(off) - rest, 0.0) / (half - rest);
    state.axes[at] = off < 0.0 ? -beyond : beyond;
    return true;
}

// Words of 64 bits in hexadecimal, the highest first.
bool gamepad::is_gamepad(const std::string& key_capabilities) {
    std::vector<uint64_t> words;
    const char* at = key_capabilities.data();
    const char* const end = at + key_capabilities.size();
    while (at != end) {
        uint64_t word = 0;
        const auto [next, error] = std::from_chars(at, end, word, 16);
        if (error != std::errc())
            return false;
        words.push_back(word);
        at = next;
        while (at != end && (*at == ' ' || *at == '\n'))
            ++at;
    }
    const size_t word = kFirstButton / 64;
    return words.size() > word && (words[words.size() - 1 - word] >> kFirstButton % 64 & 1) != 0;
}

DeviceCapabilities gamepad_capabilities() {
    return {.name = "gamepad",
            .workspace_m = glm::dvec3(0.05),
            .rate_hz = 1000.0,
            .buttons = 16,
            .senses_rotation = true};
}

std::vector<Plugged> plugged_gamepads() {
    namespace fs = std::filesystem;
    std::vector<Plugged> all;
    std::error_code error;
    for (fs::directory_iterator at("/sys/class/input", error), end; !error && at != end;
         at.increment(error)) {
        const std::string name = at->path().filename().string();
        std::ifstream file(at->path() / "device" / "capabilities" / "key");
        std::string keys;
        if (!name.starts_with("event") || !std::getline(file, keys) || !is_gamepad(keys))
            continue;
        Plugged found{.node = "/dev/input/" + name, .refusal = {}};
        if (::access(found.node.c_str(), R_OK) != 0)
            found.refusal = refusal_of_node(found.node, errno);
        all.push_back(std::move(found));
    }
    std::sort(all.begin(), all.end(), [](const Plugged& a, const Plugged& b) {
        return std::pair(a.node.size(), a.node) < std::pair(b.node.size(), b.node);
    });
    return all;
}

Result<std::unique_ptr<GamepadDevice>> GamepadDevice::open(const std::string& node) {
    Fd events(::open(node.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!events)
        return fail("{}", refusal_of_node(node, errno));
    Ranges ranges{};
    for (size_t axis = 0; axis < kAxes; ++axis) {
        input_absinfo info{};
        if (::ioctl(events.get(), EVIOCGABS(kAxisCodes[axis]), &info) == 0 &&
            info.minimum < info.maximum)
            ranges[axis] = {.low = info.minimum, .high = info.maximum, .flat = info.flat};
    }
    return std::make_unique<GamepadDevice>(std::move(events), ranges);
}

GamepadDevice::GamepadDevice(Fd events, const Ranges& ranges)
    : capabilities_(gamepad_capabilities()),
      events_(std::move(events)),
      ranges_(ranges),
      hand_(capabilities_.workspace_m) {}

Result<void> GamepadDevice::calibrate() {
    hand_.reset();
    return {};
}

DeviceStatus GamepadDevice::read(int64_t now_ns, DeviceSample& sample) noexcept {
    sample.time_ns = now_ns;
    std::array<input_event, 64> events; // of a tick; a flood is read in the next ones
    const ssize_t came = is_gone_ ? 0 : ::read(events_.get(), events.data(), sizeof(events));
    if (came == 0 || (came < 0 && errno != EAGAIN && errno != EINTR))
        is_gone_ = true;
    if (is_gone_)
        return DeviceStatus::gone;
    const size_t count = came > 0 ? static_cast<size_t>(came) / sizeof(input_event) : 0;
    for (size_t i = 0; i < count; ++i)
        apply(events[i].type, events[i].code, events[i].value, ranges_, state_);
    const auto& axes = state_.axes;
    hand_.move(now_ns, {axes[0], -axes[1], axes[3]}, {axes[5], -axes[2], -axes[4]}, sample);
    sample.buttons = state_.buttons;
    return DeviceStatus::ok;
}

} // namespace palpate::haptics
