#pragma once

#include <algorithm>
#include <deque>
#include <vector>

#include "haptics/device/transport/fake_transport.h"
#include "haptics/device/wooden/codec.h"
#include "haptics/device/wooden/kinematics.h"

namespace palpate::haptics {

// The firmware: answers each report by one, and ends the current where nothing came for 0.5 s.
class FakeWooden final : public FakePeer {
 public:
    explicit FakeWooden(const wooden::Geometry& geometry) : geometry_(geometry) {}
    glm::dvec3 place_m{0.0};
    wooden::Command command;
    wooden::Counts zero{};
    bool silent = false;
    size_t cut = 64; // of its reports
    std::vector<std::vector<std::byte>> sent;
    int encoder_shift = 0; // added to the first encoder, with the wrap of 16 bits
    bool encoders_stuck = false;

    void advance(int64_t to_ns) override {
        now_ns_ = to_ns;
        if (now_ns_ - heard_ns_ >= 500'000'000)
            command.motors_ma = {};
    }
    bool control(const UsbSetup&, std::span<const std::byte>) override { return false; }
    bool out(uint8_t, std::span<const std::byte> report) override {
        sent.emplace_back(report.begin(), report.end());
        if (report.empty() || report[0] != std::byte{0} ||
            !wooden::decode(report.subspan(1), command))
            return true;
        heard_ns_ = now_ns_;
        const auto counts = wooden::counts_of(geometry_, *wooden::inverse(geometry_, place_m));
        if (command.order == wooden::kSetEncoders)
            for (size_t i = 0; i < 3; ++i)
                zero[i] = (*counts)[i] - command.encoders[i];
        if (!encoders_stuck)
            counted_ = {static_cast<int16_t>((*counts)[0] - zero[0] + encoder_shift),
                        static_cast<int16_t>((*counts)[1] - zero[1]),
                        static_cast<int16_t>((*counts)[2] - zero[2])};
        if (!silent)
            answers_.push_back({.encoders = {counted_[0], counted_[1], counted_[2]}});
        return true;
    }
    int in(uint8_t, std::span<std::byte> room) override {
        if (answers_.empty())
            return -1;
        std::array<std::byte, 64> report{};
        const auto bytes = wooden::encode(answers_.front());
        answers_.pop_front();
        std::copy(bytes.begin(), bytes.end(), report.begin());
        const size_t size = std::min(cut, room.size());
        std::copy_n(report.begin(), size, room.begin());
        return static_cast<int>(size);
    }
    void plugged() override {
        answers_.clear();
        command = {};
    }

 private:
    const wooden::Geometry& geometry_;
    int64_t now_ns_ = 0, heard_ns_ = 0;
    std::deque<wooden::State> answers_;
    std::array<int16_t, 3> counted_{};
};

} // namespace palpate::haptics
