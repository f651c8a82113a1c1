#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "haptics/core/device.h"

namespace palpate::haptics {

// The data exchanged between servo and device in one tick.
struct DeviceRecord {
    DeviceSample sample;
    DeviceStatus status = DeviceStatus::ok;
    Wrench wrench; // written after it
};

// Two forms of one thing; both give back every bit that was put in.
//
// CSV (csv.h) has one line a record: time_ns, x_m, y_m, z_m, qw, qx, qy, qz, vx_m_per_s,
// vy_m_per_s, vz_m_per_s, buttons, status (0 .. 4, as DeviceStatus), fx_n, fy_n, fz_n, tx_nm,
// ty_nm, tz_nm. Only time_ns and the position are needed to play it.
//
// The compact form is "PLPTLOG1", the number of records as 8 bytes, and then blocks of up to 4096
// records: the number of records and of packed bytes, 4 bytes each, and a zstd frame with checksum.
// Packed are 64-bit words, column by column, each exclusive-or the word before it in its column,
// and of all words first every lowest byte, then every second, and so on. Everything is
// little-endian.
std::string csv_text(std::span<const DeviceRecord> records);
std::vector<std::byte> pack(std::span<const DeviceRecord> records);

// Refused: other formats, truncated or damaged files, falling times.
Result<std::vector<DeviceRecord>> parse_device_log(std::string_view bytes, const std::string& name);

// The form is CSV where the path ends in .csv, else compact.
Result<void> save_device_log(const std::filesystem::path& path,
                             std::span<const DeviceRecord> records);
Result<std::vector<DeviceRecord>> load_device_log(const std::filesystem::path& path);

} // namespace palpate::haptics
