#include "haptics/device/falcon/start.h"

#include <algorithm>
#include <fstream>

#include "haptics/device/falcon/bridge.h"
#include "haptics/device/falcon/codec.h"

namespace palpate::haptics::falcon {

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kPatience_ns = 50 * kMs; // for a transfer
constexpr const char* kName = "Novint Falcon";

// The serial line behind the bridge.
class Line {
 public:
    Line(Transport& transport, const std::stop_token& stop) : transport_(transport), stop_(stop) {}

    Result<void> set(BridgeRequest request, uint16_t value) {
        Transfer& transfer = transport_.transfer(kControlSlot);
        transfer.kind = TransferKind::control;
        transfer.endpoint = 0;
        transfer.setup = bridge_setup(request, value);
        transfer.size = 0;
        return run(transfer, "a request to its serial bridge");
    }

    Result<void> send(std::span<const std::byte> bytes) {
        Transfer& transfer = transport_.transfer(kOutSlot);
        transfer.kind = TransferKind::bulk;
        transfer.endpoint = kOutEndpoint;
        transfer.size = bytes.size();
        std::copy(bytes.begin(), bytes.end(), transfer.bytes.begin());
        return run(transfer, "sending");
    }

    // Bytes from the line until there are `count` or time is over; then fewer. Errors of the bus
    // are bytes that did not come; only an unplugged device ends it.
    Result<std::vector<std::byte>> receive(size_t count, int64_t patience_ns) {
        Transfer& transfer = transport_.transfer(kInSlot);
        transfer.kind = TransferKind::bulk;
        transfer.endpoint = kInEndpoint;
        transfer.size = kUsbPacket;
        const int64_t until_ns = transport_.clock().now_ns() + patience_ns;
        while (pending_.size() < count && !stop_.stop_requested()) {
            const int64_t left_ns = until_ns - transport_.clock().now_ns();
            if (left_ns <= 0)
                break;
            const TransferStatus status = run_transfer(transport_, transfer, left_ns);
            if (transport_.gone())
                return fail("{}: unplugged while it was being set up", kName);
            if (status == TransferStatus::done) {
                const auto bytes = payload_of(transfer.received());
                pending_.insert(pending_.end(), bytes.begin(), bytes.end());
            } else if (status != TransferStatus::timed_out) {
                transport_.clock().sleep_until(transport_.clock().now_ns() + kMs);
            }
        }
        const auto end = pending_.begin() + static_cast<long>(std::min(count, pending_.size()));
        std::vector<std::byte> bytes(pending_.begin(), end);
        pending_.erase(pending_.begin(), end);
        return bytes;
    }
    void forget() { pending_.clear(); }

    Result<void> check() const {
        if (stop_.stop_requested())
            return fail("{}: interrupted while it was being set up", kName);
        return {};
    }

 private:
    Result<void> run(Transfer& transfer, const char* what) {
        const TransferStatus status = run_transfer(transport_, transfer, kPatience_ns);
        if (transport_.gone())
            return fail("{}: unplugged while it was being set up", kName);
        if (status != TransferStatus::done)
            return fail("{}: {} failed: {}", kName, what, text_of(status));
        return check();
    }

    Transport& transport_;
    std::stop_token stop_;
    std::vector<std::byte> pending_; // came and was not asked for yet
};

struct Setting {
    BridgeRequest request;
    uint16_t value;
};

Result<void> set_all(Line& line, std::span<const Setting> settings) {
    for (const Setting& setting : settings)
        PALPATE_TRY(line.set(setting.request, setting.value));
    return {};
}

constexpr Setting kRunSettings[] = {
    {BridgeRequest::format, 8},          {BridgeRequest::flow, 0},
    {BridgeRequest::latency, 1},         {BridgeRequest::divisor, kBaudRun},
    {BridgeRequest::event, 0x100 | '>'}, {BridgeRequest::reset, 1},
    {BridgeRequest::reset, 2},
};
constexpr Setting kBootSettings[] = {
    {BridgeRequest::reset, 1},
    {BridgeRequest::reset, 2},
    {BridgeRequest::event, 0},
    {BridgeRequest::latency, 16},
    {BridgeRequest::divisor, kBaud9600},
    {BridgeRequest::format, 8},
    {BridgeRequest::flow, 0},
    {BridgeRequest::modem, kRtsLow},
    {BridgeRequest::modem, kDtrLow},
    {BridgeRequest::modem, kDtrHigh},
};

// Whether the run-time firmware answers a command without force.
Result<bool> answers(Line& line) {
    PALPATE_TRY(set_all(line, kRunSettings));
    line.forget();
    Framer framer;
    for (int attempt = 0; attempt < 8; ++attempt) {
        PALPATE_TRY(line.send(encode(Command{})));
        PALPATE_TRY(const std::vector<std::byte> bytes, line.receive(kPacket, 20 * kMs));
        Packet packet;
        State state;
        for (const std::byte byte : bytes)
            if (framer.add(byte, packet) && decode(packet, state))
                return true;
        PALPATE_TRY(line.check());
    }
    return false;
}

Result<void> greet(Line& line) {
    constexpr std::array kHello{std::byte{0x0A}, std::byte{0x43}, std::byte{0x0D}};
    constexpr std::array kAnswer{std::byte{0x0A}, std::byte{0x44}, std::byte{0x2C},
                                 std::byte{0x0D}};
    PALPATE_TRY(set_all(line, kBootSettings));
    line.forget();
    for (int attempt = 0; attempt < 30; ++attempt) {
        PALPATE_TRY(line.send(kHello));
        // A 0 may come before it.
        PALPATE_TRY(const std::vector<std::byte> bytes, line.receive(kAnswer.size() + 1, 25 * kMs));
        if (std::search(bytes.begin(), bytes.end(), kAnswer.begin(), kAnswer.end()) != bytes.end())
            return {};
        PALPATE_TRY(line.check());
    }
    return fail("{}: its boot program does not answer; is its power supply plugged in?", kName);
}

Result<void> load(Line& line, std::span<const std::byte> firmware) {
    PALPATE_TRY(greet(line));
    PALPATE_TRY(line.set(BridgeRequest::modem, kDtrLow));
    PALPATE_TRY(line.set(BridgeRequest::divisor, kBaudLoad));
    line.forget();
    constexpr std::array kBegin{std::byte{0x41}};
    PALPATE_TRY(line.send(kBegin));
    PALPATE_TRY(const std::vector<std::byte> ready, line.receive(1, 60 * kMs));
    if (ready.size() != 1 || ready[0] != kBegin[0])
        return fail("{}: its boot program takes no firmware", kName);
    for (size_t at = 0; at < firmware.size(); at += kPayload) {
        const auto chunk = firmware.subspan(at, std::min(kPayload, firmware.size() - at));
        PALPATE_TRY(line.send(chunk));
        PALPATE_TRY(const std::vector<std::byte> echo, line.receive(chunk.size(), 60 * kMs));
        PALPATE_TRY(line.check());
        const auto [sent, came] =
            std::mismatch(chunk.begin(), chunk.end(), echo.begin(), echo.end());
        if (sent != chunk.end())
            return fail(
                "{}: the firmware did not arrive: byte {} of {} {}; switch the device off and on",
                kName, at + static_cast<size_t>(sent - chunk.begin()), firmware.size(),
                came == echo.end() ? "was not confirmed" : "came back changed");
    }
    return {};
}

} // namespace

Result<std::vector<std::byte>> load_firmware(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file)
        return fail("{}: expected the firmware of a Novint Falcon, found no file that can be read",
                    path.string());
    std::vector<std::byte> bytes(kMostFirmware + 1);
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<size_t>(file.gcount()));
    if (bytes.size() < kLeastFirmware || bytes.size() > kMostFirmware)
        return fail("{}: expected the firmware of a Novint Falcon, {} to {} bytes, found {}{}",
                    path.string(), kLeastFirmware, kMostFirmware,
                    bytes.size() > kMostFirmware ? "more than " : "",
                    std::min(bytes.size(), kMostFirmware));
    const bool is_text = std::all_of(bytes.begin(), bytes.end(), [](std::byte byte) {
        const auto c = std::to_integer<unsigned char>(byte);
        return c == '\t' || c == '\n' || c == '\r' || (c >= ' ' && c < 127);
    });
    if (is_text)
        return fail("{}: expected the firmware of a Novint Falcon, found text", path.string());
    return bytes;
}

Result<Started> start(Transport& transport, std::span<const std::byte> firmware,
                      const std::stop_token& stop) {
    Line line(transport, stop);
    PALPATE_TRY(const bool is_running, answers(line));
    if (is_running)
        return Started::was_running;
    if (firmware.empty())
        return fail(
            "{}: no firmware is loaded in it, or its power supply is off; `palpate devices "
            "novint-falcon --firmware FILE` loads the maker's",
            kName);
    PALPATE_TRY(load(line, firmware));
    PALPATE_TRY(const bool runs, answers(line));
    if (!runs)
        return fail("{}: the firmware that was loaded does not run; is it one of this device?",
                    kName);
    return Started::loaded;
}

} // namespace palpate::haptics::falcon
