#include "haptics/device/device_log.h"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "engine/base/assert.h"
#include "engine/base/file.h"
#include "haptics/device/csv.h"

namespace palpate::haptics {

namespace {

constexpr std::string_view kMagic = "PLPTLOG1";
constexpr size_t kBlock = 4096; // records
constexpr size_t kColumns = 19; // words a record
constexpr int kCompression = 3;
constexpr uint64_t kMostRecords = 500'000'000;

using Words = std::array<uint64_t, kColumns>;

Words words_of(const DeviceRecord& r) {
    const DeviceSample& s = r.sample;
    const auto bits = [](double value) { return std::bit_cast<uint64_t>(value); };
    return {static_cast<uint64_t>(s.time_ns),
            bits(s.position_m.x),
            bits(s.position_m.y),
            bits(s.position_m.z),
            bits(s.rotation.w),
            bits(s.rotation.x),
            bits(s.rotation.y),
            bits(s.rotation.z),
            bits(s.velocity_m_per_s.x),
            bits(s.velocity_m_per_s.y),
            bits(s.velocity_m_per_s.z),
            s.buttons,
            static_cast<uint64_t>(r.status),
            bits(r.wrench.force_n.x),
            bits(r.wrench.force_n.y),
            bits(r.wrench.force_n.z),
            bits(r.wrench.torque_nm.x),
            bits(r.wrench.torque_nm.y),
            bits(r.wrench.torque_nm.z)};
}

DeviceRecord record_of(const Words& w) {
    const auto number = [&](size_t i) { return std::bit_cast<double>(w[i]); };
    DeviceRecord r;
    r.sample = {.time_ns = static_cast<int64_t>(w[0]),
                .position_m = {number(1), number(2), number(3)},
                .rotation = {number(4), number(5), number(6), number(7)},
                .velocity_m_per_s = {number(8), number(9), number(10)},
                .buttons = static_cast<uint32_t>(w[11])};
    r.status = static_cast<DeviceStatus>(w[12]);
    r.wrench = {{number(13), number(14), number(15)}, {number(16), number(17), number(18)}};
    return r;
}

template <class Word>
void put(std::vector<std::byte>& out, Word word) {
    for (size_t i = 0; i < sizeof(Word); ++i)
        out.push_back(static_cast<std::byte>(word >> 8 * i & 0xFF));
}

template <class Word>
Word get(std::string_view bytes, size_t at) {
    Word word = 0;
    for (size_t i = 0; i < sizeof(Word); ++i)
        word |= Word{static_cast<unsigned char>(bytes[at + i])} << 8 * i;
    return word;
}

std::vector<std::byte> shuffled(std::span<const DeviceRecord> block) {
    std::vector<std::byte> bytes(block.size() * kColumns * 8);
    Words before{};
    for (size_t r = 0; r < block.size(); ++r) {
        const Words now = words_of(block[r]);
        for (size_t c = 0; c < kColumns; ++c)
            for (size_t b = 0; b < 8; ++b)
                bytes[b * block.size() * kColumns + c * block.size() + r] =
                    static_cast<std::byte>((now[c] ^ before[c]) >> 8 * b & 0xFF);
        before = now;
    }
    return bytes;
}

void unshuffle(std::string_view bytes, size_t count, std::vector<DeviceRecord>& out) {
    Words now{};
    for (size_t r = 0; r < count; ++r) {
        for (size_t c = 0; c < kColumns; ++c)
            for (size_t b = 0; b < 8; ++b)
                now[c] ^= uint64_t{static_cast<unsigned char>(
                              bytes[b * count * kColumns + c * count + r])}
                          << 8 * b;
        out.push_back(record_of(now));
    }
}

Result<void> check(const std::vector<DeviceRecord>& records, const std::string& name) {
    for (size_t i = 0; i < records.size(); ++i) {
        if (records[i].status > DeviceStatus::gone)
            return fail("{}: record {}: expected a status from 0 to 4, found {}", name, i,
                        static_cast<int>(records[i].status));
        if (i > 0 && records[i].sample.time_ns < records[i - 1].sample.time_ns)
            return fail("{}: record {}: expected a time of {} ns or later, found {}", name, i,
                        records[i - 1].sample.time_ns, records[i].sample.time_ns);
    }
    return {};
}

Result<std::vector<DeviceRecord>> unpack(std::string_view bytes, const std::string& name) {
    const auto cut = [&] { return fail("{}: expected a whole log, found it cut short", name); };
    if (bytes.size() < kMagic.size() + 8)
        return cut();
    const uint64_t count = get<uint64_t>(bytes, kMagic.size());
    bytes.remove_prefix(kMagic.size() + 8);
    if (count > kMostRecords)
        return fail("{}: expected at most {} records, found {}", name, kMostRecords, count);
    std::vector<DeviceRecord> records;
    std::string block;
    while (records.size() < count) {
        if (bytes.size() < 8)
            return cut();
        const size_t in_block = get<uint32_t>(bytes, 0), packed = get<uint32_t>(bytes, 4);
        bytes.remove_prefix(8);
        if (in_block == 0 || in_block > kBlock || in_block > count - records.size())
            return fail("{}: expected 1 to {} records in a block, found {}", name,
                        std::min<uint64_t>(kBlock, count - records.size()), in_block);
        if (bytes.size() < packed)
            return cut();
        block.resize(in_block * kColumns * 8);
        const size_t got = ZSTD_decompress(block.data(), block.size(), bytes.data(), packed);
        if (ZSTD_isError(got) || got != block.size())
            return fail("{}: record {}: expected a sound block, found it damaged", name,
                        records.size());
        unshuffle(block, in_block, records);
        bytes.remove_prefix(packed);
    }
    if (!bytes.empty())
        return fail("{}: expected nothing after {} records, found {} bytes", name, count,
                    bytes.size());
    return records;
}

constexpr CsvColumn kCsv[kColumns] = {{"time_ns"},
                                      {"x_m"},
                                      {"y_m"},
                                      {"z_m"},
                                      {"qw", false, 1.0},
                                      {"qx", false},
                                      {"qy", false},
                                      {"qz", false},
                                      {"vx_m_per_s", false},
                                      {"vy_m_per_s", false},
                                      {"vz_m_per_s", false},
                                      {"buttons", false},
                                      {"status", false},
                                      {"fx_n", false},
                                      {"fy_n", false},
                                      {"fz_n", false},
                                      {"tx_nm", false},
                                      {"ty_nm", false},
                                      {"tz_nm", false}};

bool is_whole(size_t column) {
    return column == 0 || column == 11 || column == 12;
}

Result<std::vector<DeviceRecord>> parse_csv(std::string_view text, const std::string& name) {
    std::vector<DeviceRecord> records;
    const auto add = [&](std::span<const double> v, size_t line) -> Result<void> {
        Words words;
        for (size_t c = 0; c < kColumns; ++c) {
            if (!is_whole(c)) {
                words[c] = std::bit_cast<uint64_t>(v[c]);
                continue;
            }
            // Whole numbers up to 2^53 are exact in a double.
            const double low = c == 0 ? -0x1p53 : 0.0;
            const double high = c == 0 ? 0x1p53 : c == 11 ? 4294967295.0 : 4.0;
            if (!(v[c] >= low && v[c] <= high) || v[c] != std::floor(v[c]))
                return fail("{}:{}: {}: expected a whole number from {} to {}, found {}", name,
                            line, kCsv[c].name, low, high, v[c]);
            words[c] = static_cast<uint64_t>(static_cast<int64_t>(v[c]));
        }
        records.push_back(record_of(words));
        return {};
    };
    PALPATE_TRY(read_csv(text, name, kCsv, add));
    return records;
}

} // namespace

std::string csv_text(std::span<const DeviceRecord> records) {
    std::string text;
    for (size_t c = 0; c < kColumns; ++c)
        text += fmt::format("{}{}", kCsv[c].name, c + 1 < kColumns ? "," : "\n");
    for (const DeviceRecord& record : records) {
        const Words words = words_of(record);
        for (size_t c = 0; c < kColumns; ++c) {
            if (is_whole(c))
                fmt::format_to(std::back_inserter(text), "{}", static_cast<int64_t>(words[c]));
            else
                fmt::format_to(std::back_inserter(text), "{}", std::bit_cast<double>(words[c]));
            text += c + 1 < kColumns ? ',' : '\n';
        }
    }
    return text;
}

std::vector<std::byte> pack(std::span<const DeviceRecord> records) {
    std::vector<std::byte> out;
    for (const char c : kMagic)
        out.push_back(static_cast<std::byte>(c));
    put<uint64_t>(out, records.size());
    ZSTD_CCtx* context = ZSTD_createCCtx();
    ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, kCompression);
    ZSTD_CCtx_setParameter(context, ZSTD_c_checksumFlag, 1);
    for (size_t first = 0; first < records.size(); first += kBlock) {
        const auto block = records.subspan(first, std::min(kBlock, records.size() - first));
        const std::vector<std::byte> bytes = shuffled(block);
        std::vector<std::byte> packed(ZSTD_compressBound(bytes.size()));
        const size_t size =
            ZSTD_compress2(context, packed.data(), packed.size(), bytes.data(), bytes.size());
        PALPATE_ASSERT(!ZSTD_isError(size)); // there is room, and memory is not refused
        put(out, static_cast<uint32_t>(block.size()));
        put(out, static_cast<uint32_t>(size));
        out.insert(out.end(), packed.begin(), packed.begin() + static_cast<ptrdiff_t>(size));
    }
    ZSTD_freeCCtx(context);
    return out;
}

Result<std::vector<DeviceRecord>> parse_device_log(std::string_view bytes,
                                                   const std::string& name) {
    PALPATE_TRY(std::vector<DeviceRecord> records, bytes.substr(0, kMagic.size()) == kMagic
                                                       ? unpack(bytes, name)
                                                       : parse_csv(bytes, name));
    PALPATE_TRY(check(records, name));
    return records;
}

Result<void> save_device_log(const std::filesystem::path& path,
                             std::span<const DeviceRecord> records) {
    if (path.extension() == ".csv") {
        const std::string text = csv_text(records);
        return save_bytes(path, std::as_bytes(std::span(text)));
    }
    return save_bytes(path, pack(records));
}

Result<std::vector<DeviceRecord>> load_device_log(const std::filesystem::path& path) {
    PALPATE_TRY(const std::string bytes, load_text(path, uint64_t{16} << 30));
    return parse_device_log(bytes, path.string());
}

} // namespace palpate::haptics
