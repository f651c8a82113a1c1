// Does what a person with a Falcon does, as docs/guide/devices.md says it: plug in, load the
// firmware, home, feel a volume, unplug. The program is the real one, and so is libusb; the device
// is a model on a kernel that umockdev imitates, with a hand of its own.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "haptics/core/clock.h"
#include "haptics/device/falcon/fake_falcon.h"
#include "tests/support/program.h"
#include "tests/support/usb_bed.h"

namespace palpate::haptics {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

constexpr int64_t kMs = 1'000'000;

std::string image() {
    std::string bytes(4999, '\0');
    for (size_t i = 0; i < bytes.size(); ++i)
        bytes[i] = static_cast<char>(i * 31 + i / 7);
    return bytes;
}

falcon::FakeFalconSetup as_plugged_in() {
    falcon::FakeFalconSetup setup{.is_loaded = false, .is_homed = false, .homing_packets = 30};
    for (const char c : image())
        setup.firmware.push_back(static_cast<std::byte>(c));
    // The hand rests 30 mm towards the person, and goes to the middle and back, again and again.
    std::vector<HandPose> poses{{.time_s = 0.0, .tool = {.position_mm = {0, 0, 30}}}};
    for (int i = 0; i < 60; ++i) {
        const double begin_s = 4.0 * i;
        poses.push_back({.time_s = begin_s + 2.5, .tool = {.position_mm = {0, 0, 30}}});
        poses.push_back({.time_s = begin_s + 3.0, .tool = {.position_mm = {0, 0, 5}}});
        poses.push_back({.time_s = begin_s + 3.6, .tool = {.position_mm = {0, 0, 5}}});
        poses.push_back({.time_s = begin_s + 3.9, .tool = {.position_mm = {0, 0, 30}}});
    }
    setup.path = HandPath(std::move(poses));
    return setup;
}

class Live : public ProgramTest {
 protected:
    int64_t begin_ns = monotonic_ns();
    falcon::FakeFalcon model{as_plugged_in()};
    UsbBed bed{model, [this] { return monotonic_ns() - begin_ns; }};

    template <class Look>
    auto look(Look&& of) {
        const auto lock = bed.hold();
        return of(model);
    }
};

// Live takes over 5 s of a processor: the session lasts as long as the device takes, and a servo
// ticks meanwhile.
TEST_F(Live, FromPluggingInToFeelingAVolume) {
    // 1. It is listed, and says what it needs.
    EXPECT_THAT(run({"devices"}).output, HasSubstr("novint-falcon (novint): Novint Falcon"));
    EXPECT_THAT(run({"devices", "novint-falcon", "--home"}).messages,
                HasSubstr("no firmware is loaded in it"));
    // 2. and 3. Firmware and homing.
    write("firmware.bin", image());
    const ProgramRun loaded =
        run({"devices", "novint-falcon", "--firmware", file("firmware.bin").string(), "--home"});
    ASSERT_EQ(loaded.exit_code, 0) << loaded.messages;
    EXPECT_THAT(loaded.messages, HasSubstr("novint-falcon is homed"));
    EXPECT_TRUE(look([](const falcon::FakeFalcon& f) { return f.runs(); }));
    // 4. A person presses Enter every second: first to allow force, and again where a machine
    // that is busy was late and force ended. The ball of 34 mm meets the hand on its way.
    const std::string command =
        "(for i in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20; do echo; sleep 1; done) | "
        "'" +
        std::string(kProgram) +
        "' touch synthetic:ball --device novint-falcon --live --stiffness 300 --duration 16 "
        "--report '" +
        file("touch.csv").string() + "' --page '" + file("touch.html").string() + "' >'" +
        file("stdout").string() + "' 2>'" + file("stderr").string() + "'";
    const int status = std::system(command.c_str());
    ASSERT_EQ(WEXITSTATUS(status), 0) << bytes_of("stderr");
    EXPECT_THAT(bytes_of("stderr"), HasSubstr("force fades in when nothing is touched"));
    const json summary = json::parse(bytes_of("stdout"));
    EXPECT_GT(summary["path_ticks"], 300);
    EXPECT_GT(summary["contact_ticks"], 10);
    EXPECT_GT(summary["most_force_n"], 0.2);
    // Counts: the model's motors got it.
    EXPECT_GT(look([](const falcon::FakeFalcon& f) { return f.most_motors()[0]; }), 20);
    EXPECT_THAT(bytes_of("touch.html"), HasSubstr("novint-falcon"));
    // No force stays.
    EXPECT_EQ(look([&](falcon::FakeFalcon& f) {
                  f.advance(monotonic_ns() - begin_ns + 5 * kMs);
                  return f.command().motors;
              }),
              (falcon::Counts{}));
}

} // namespace
} // namespace palpate::haptics

int main(int argc, char** argv) {
    palpate::haptics::run_with_umockdev(argv);
    ::testing::InitGoogleMock(&argc, argv);
    return RUN_ALL_TESTS();
}
