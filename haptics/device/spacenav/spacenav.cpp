#include "haptics/device/spacenav/spacenav.h"

#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace palpate::haptics {

using namespace spacenav;

bool spacenav::apply(std::span<const std::byte, kEvent> event, State& state) noexcept {
    std::array<int32_t, kEvent / 4> numbers;
    std::memcpy(numbers.data(), event.data(), kEvent);
    enum { motion, press, release };
    switch (numbers[0]) {
        case motion:
            for (size_t axis = 0; axis < 6; ++axis)
                state.axes[axis] = std::clamp<int>(numbers[1 + axis], -kRange, kRange);
            return true;
        case press:
        case release:
            if (numbers[1] < 0 || numbers[1] >= 32)
                return false;
            if (numbers[0] == press)
                state.buttons |= 1u << numbers[1];
            else
                state.buttons &= ~(1u << numbers[1]);
            return true;
        default:
            return false;
    }
}

DeviceCapabilities spacenav_capabilities() {
    return {.name = "6-axis device of spacenavd",
            .workspace_m = glm::dvec3(0.05),
            .rate_hz = 1000.0,
            .buttons = 32,
            .senses_rotation = true};
}

Result<std::unique_ptr<SpacenavDevice>> SpacenavDevice::open(const std::string& socket) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (socket.size() >= sizeof(address.sun_path))
        return fail("{}: expected a path of at most {} characters", socket,
                    sizeof(address.sun_path) - 1);
    std::copy(socket.begin(), socket.end(), address.sun_path);
    Fd own(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!own ||
        ::connect(own.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
        return fail("{}: spacenavd does not answer: {}", socket, ::strerror(errno));
    return std::make_unique<SpacenavDevice>(std::move(own));
}

SpacenavDevice::SpacenavDevice(Fd socket)
    : capabilities_(spacenav_capabilities()),
      socket_(std::move(socket)),
      hand_(capabilities_.workspace_m) {}

Result<void> SpacenavDevice::calibrate() {
    hand_.reset();
    return {};
}

DeviceStatus SpacenavDevice::read(int64_t now_ns, DeviceSample& sample) noexcept {
    sample.time_ns = now_ns;
    constexpr int kMostEvents = 32; // of a tick; a flood is read in the next ones
    for (int i = 0; i < kMostEvents && !is_gone_; ++i) {
        const ssize_t came =
            ::recv(socket_.get(), event_.data() + came_, kEvent - came_, MSG_DONTWAIT);
        if (came < 0 && (errno == EAGAIN || errno == EINTR))
            break;
        if (came <= 0) {
            is_gone_ = true;
            break;
        }
        came_ += static_cast<size_t>(came);
        if (came_ == kEvent) {
            came_ = 0;
            spacenav::apply(event_, state_);
        }
    }
    if (is_gone_)
        return DeviceStatus::gone;
    const auto share = [&](size_t axis) { return static_cast<double>(state_.axes[axis]) / kRange; };
    // A turn is an axial vector: with the third axis turned round, the other two of it are.
    hand_.move(now_ns, {share(0), share(1), -share(2)}, {-share(3), -share(4), share(5)}, sample);
    sample.buttons = state_.buttons;
    return DeviceStatus::ok;
}

} // namespace palpate::haptics
