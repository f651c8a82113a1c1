#include "haptics/device/wooden/codec.h"

namespace palpate::haptics::wooden {

namespace {

using Numbers = std::array<int16_t, kReport / 2>;

std::array<std::byte, kReport> bytes_of(const Numbers& numbers) {
    std::array<std::byte, kReport> bytes;
    for (size_t at = 0; at < numbers.size(); ++at) {
        const auto raw = static_cast<uint16_t>(numbers[at]);
        bytes[2 * at] = static_cast<std::byte>(raw & 0xFFu);
        bytes[2 * at + 1] = static_cast<std::byte>(raw >> 8u);
    }
    return bytes;
}

bool read(std::span<const std::byte> report, Numbers& numbers) {
    if (report.size() < kReport)
        return false;
    for (size_t at = 0; at < numbers.size(); ++at)
        numbers[at] = static_cast<int16_t>(std::to_integer<unsigned>(report[2 * at]) |
                                           std::to_integer<unsigned>(report[2 * at + 1]) << 8u);
    return true;
}

} // namespace

std::array<std::byte, kReport> encode(const Command& c) noexcept {
    return bytes_of({c.motors_ma[0], c.motors_ma[1], c.motors_ma[2], c.order, c.encoders[0],
                     c.encoders[1], c.encoders[2]});
}

std::array<std::byte, kReport> encode(const State& s) noexcept {
    return bytes_of({s.encoders[0], s.encoders[1], s.encoders[2], s.encoders[3], s.encoders[4],
                     s.encoders[5], s.info});
}

bool decode(std::span<const std::byte> report, Command& command) noexcept {
    Numbers n;
    if (!read(report, n))
        return false;
    command = {.motors_ma = {n[0], n[1], n[2]}, .order = n[3], .encoders = {n[4], n[5], n[6]}};
    return true;
}

bool decode(std::span<const std::byte> report, State& state) noexcept {
    Numbers n;
    if (!read(report, n))
        return false;
    state = {.encoders = {n[0], n[1], n[2], n[3], n[4], n[5]}, .info = n[6]};
    return true;
}

} // namespace palpate::haptics::wooden
