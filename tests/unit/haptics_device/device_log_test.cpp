#include "haptics/device/device_log.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

#include "haptics/device/recorded.h"
#include "tests/support/temporary_folder.h"

namespace palpate::haptics {
namespace {

std::vector<DeviceRecord> some_records(size_t count) {
    std::mt19937_64 random(7);
    const auto number = [&] {
        return std::ldexp(static_cast<double>(static_cast<int64_t>(random())), -70);
    };
    std::vector<DeviceRecord> records(count);
    for (size_t i = 0; i < count; ++i) {
        DeviceRecord& r = records[i];
        r.sample.time_ns = static_cast<int64_t>(i) * 1'000'000 + 17;
        r.sample.position_m = {number(), number(), -0.0};
        r.sample.rotation = {number(), number(), number(), number()};
        r.sample.velocity_m_per_s = {number(), 0.0, 5e-324};
        r.sample.buttons = static_cast<uint32_t>(random());
        r.status = static_cast<DeviceStatus>(i % 5);
        r.wrench = {{number(), number(), number()}, {number(), number(), number()}};
    }
    return records;
}

bool same_bits(const DeviceRecord& a, const DeviceRecord& b) {
    const std::vector<std::byte> x = pack(std::span(&a, 1)), y = pack(std::span(&b, 1));
    return x == y;
}

class DeviceLogFile : public TemporaryFolder {};

TEST_F(DeviceLogFile, BothFormsGiveBackEveryBit) {
    for (const size_t count : {size_t{1}, size_t{2}, size_t{300}, size_t{4096}, size_t{4097}})
        for (const char* name : {"log.csv", "log.plog"}) {
            const std::vector<DeviceRecord> records = some_records(count);
            ASSERT_TRUE(save_device_log(file(name), records));
            const Result<std::vector<DeviceRecord>> back = load_device_log(file(name));
            ASSERT_TRUE(back) << back.error().message;
            ASSERT_EQ(back->size(), count);
            for (size_t i = 0; i < count; i += 1 + count / 50)
                ASSERT_TRUE(same_bits((*back)[i], records[i])) << name << ' ' << i;
        }
}

TEST(DeviceLog, NoTruncatedOrDamagedCompactLogIsTakenForAnother) {
    const std::vector<std::byte> bytes = pack(some_records(40));
    const std::string whole(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    for (size_t size = 0; size < whole.size(); ++size) {
        const auto log = parse_device_log(whole.substr(0, size), "log");
        ASSERT_FALSE(log) << size;
        ASSERT_EQ(log.error().message.substr(0, 3), "log");
    }
    size_t refused = 0;
    for (size_t at = 0; at < whole.size(); ++at) {
        std::string damaged = whole;
        damaged[at] = static_cast<char>(damaged[at] ^ 0x20);
        // A frame has a few bits that mean nothing: then what is read is what was written.
        const auto log = parse_device_log(damaged, "log");
        refused += !log;
        if (log) {
            ASSERT_EQ(pack(*log), bytes) << at;
        }
    }
    EXPECT_GT(refused, whole.size() - whole.size() / 100);
    EXPECT_FALSE(parse_device_log(whole + "x", "log"));
}

TEST(DeviceLog, RefusesWhatIsNoLog) {
    const auto why = [](const std::string& text) {
        const auto log = parse_device_log(text, "log.csv");
        return log ? std::string("nothing") : log.error().message;
    };
    EXPECT_EQ(why("time_ns,x_m,y_m,z_m\n1.5,0,0,0\n").substr(0, 50),
              "log.csv:2: time_ns: expected a whole number from -");
    EXPECT_EQ(why("time_ns,x_m,y_m,z_m,status\n1,0,0,0,5\n"),
              "log.csv:2: status: expected a whole number from 0 to 4, found 5");
    EXPECT_EQ(why("time_ns,x_m,y_m,z_m\n2,0,0,0\n1,0,0,0\n"),
              "log.csv: record 1: expected a time of 2 ns or later, found 1");
}

TEST(DeviceLog, TheCompactFormIsCompact) {
    // A hand at 1 kHz: smooth motion in encoder steps, at rest for half of the time.
    std::vector<DeviceRecord> records(10000);
    for (size_t i = 0; i < records.size(); ++i) {
        records[i].sample.time_ns = static_cast<int64_t>(i) * 1'000'000;
        const double x = i < 5000 ? 0.02 * std::sin(1e-3 * static_cast<double>(i)) : 0.0;
        records[i].sample.position_m.x = std::floor(x / 50e-6) * 50e-6;
    }
    // A tenth of its 152 bytes a record at most; of CSV, far less still.
    EXPECT_LE(pack(records).size(), records.size() * 152 / 10);
}

TEST(Recorded, PlaysWhatWasRecordedAtItsOwnTimes) {
    std::vector<DeviceRecord> records = some_records(3);
    records[1].status = DeviceStatus::not_homed;
    records[2].status = DeviceStatus::ok;
    RecordedDevice device({.name = "log"}, records, 500);
    DeviceSample sample;
    EXPECT_EQ(device.read(499, sample), DeviceStatus::stale);
    EXPECT_EQ(device.read(500, sample), DeviceStatus::ok);
    EXPECT_EQ(sample.position_m, records[0].sample.position_m);
    EXPECT_EQ(device.read(900'000, sample), DeviceStatus::stale);
    EXPECT_EQ(device.read(1'000'500, sample), DeviceStatus::not_homed);
    EXPECT_EQ(sample.position_m, records[0].sample.position_m);
    EXPECT_EQ(sample.time_ns, 1'000'500);
    EXPECT_EQ(device.read(2'000'500, sample), DeviceStatus::ok);
    EXPECT_EQ(sample.position_m, records[2].sample.position_m);
    EXPECT_EQ(device.read(3'000'500, sample), DeviceStatus::ended);
}

TEST(Recorded, ARecordingOfARecordingIsTheRecording) {
    const HandPath path = find_trajectory("touch")->make({.duration_s = 0.2});
    const Workspace workspace({0, 0, -5}, 1.0);
    const std::vector<DeviceRecord> records = records_of_path(path, workspace, 1'000'000);
    RecordedDevice source({.name = "path"}, records);
    RecordingDevice recorder(source, 64);
    std::vector<DeviceRecord> again;
    for (size_t i = 0; i < records.size(); ++i) {
        DeviceSample sample;
        const auto now_ns = static_cast<int64_t>(i) * 1'000'000;
        ASSERT_EQ(recorder.read(now_ns, sample), DeviceStatus::ok);
        recorder.write(now_ns, {});
        if (i % 50 == 0)
            recorder.drain(again);
    }
    recorder.drain(again);
    EXPECT_EQ(recorder.dropped(), 0u);
    EXPECT_EQ(pack(again), pack(records));
}

TEST(Recorded, AFullRecorderDropsAndCountsAndGoesOn) {
    RecordedDevice source({.name = "one"}, {DeviceRecord{}});
    RecordingDevice recorder(source, 4);
    for (int i = 0; i < 7; ++i)
        EXPECT_EQ(recorder.write(i, {}), DeviceStatus::ok);
    EXPECT_EQ(recorder.dropped(), 3u);
}

} // namespace
} // namespace palpate::haptics
