#include "haptics/device/recorded.h"

#include <cmath>

#include "engine/base/assert.h"

namespace palpate::haptics {

RecordedDevice::RecordedDevice(DeviceCapabilities capabilities, std::vector<DeviceRecord> records,
                               int64_t start_ns)
    : capabilities_(std::move(capabilities)), records_(std::move(records)), start_ns_(start_ns) {
    PALPATE_ASSERT(!records_.empty());
}

DeviceStatus RecordedDevice::read(int64_t now_ns, DeviceSample& sample) noexcept {
    const int64_t at_ns = now_ns - start_ns_ + records_.front().sample.time_ns;
    const size_t before = next_;
    while (next_ < records_.size() && records_[next_].sample.time_ns <= at_ns)
        ++next_;
    sample.time_ns = now_ns;
    if (next_ == 0)
        return DeviceStatus::stale;
    const DeviceRecord& record = records_[next_ - 1];
    if (next_ == records_.size() && before == next_)
        return DeviceStatus::ended;
    if (record.status == DeviceStatus::ok) {
        sample = record.sample;
        sample.time_ns = now_ns;
    }
    return before == next_ ? DeviceStatus::stale : record.status;
}

std::vector<DeviceRecord> records_of_path(const HandPath& path, const Workspace& workspace,
                                          int64_t period_ns) {
    const double start_s = path.poses().front().time_s;
    const auto count =
        static_cast<int64_t>(
            std::floor((path.end_s() - start_s) * 1e9 / static_cast<double>(period_ns) + 1e-6)) +
        1;
    std::vector<DeviceRecord> records(static_cast<size_t>(count));
    const glm::dquat device_from_world = glm::conjugate(workspace.rotation());
    for (int64_t i = 0; i < count; ++i) {
        const double time_s = start_s + static_cast<double>(i * period_ns) * 1e-9;
        const HandPose pose = path.at(time_s);
        DeviceSample& sample = records[static_cast<size_t>(i)].sample;
        sample.time_ns = i * period_ns;
        sample.position_m = workspace.device_position_m(pose.tool.position_mm);
        sample.rotation = device_from_world * pose.tool.rotation;
        sample.velocity_m_per_s =
            device_from_world * path.velocity_mm_per_s(time_s) / (1000.0 * workspace.scale());
        sample.buttons = pose.buttons;
    }
    return records;
}

DeviceStatus RecordingDevice::read(int64_t now_ns, DeviceSample& sample) noexcept {
    now_.status = device_.read(now_ns, sample);
    now_.sample = sample;
    return now_.status;
}

DeviceStatus RecordingDevice::write(int64_t now_ns, const Wrench& wrench) noexcept {
    now_.wrench = wrench;
    if (!ring_.push(now_))
        dropped_.fetch_add(1, std::memory_order_relaxed);
    return device_.write(now_ns, wrench);
}

void RecordingDevice::drain(std::vector<DeviceRecord>& records) {
    for (DeviceRecord record; ring_.pop(record);)
        records.push_back(record);
}

} // namespace palpate::haptics
