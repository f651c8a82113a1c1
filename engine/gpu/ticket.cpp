// Results of submitted commands, and when they are there.

#include <volk.h>

#include <algorithm>
#include <utility>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/gpu/error.h"
#include "engine/gpu/recorded.h"

namespace palpate {

uint64_t Ticket::value() const {
    return recorded_->submitted ? recorded_->parts.back().value : 0;
}

bool Ticket::ready() const {
    return recorded_->submitted && value() <= recorded_->device->passed();
}

void Ticket::wait() const {
    if (recorded_->submitted)
        recorded_->device->wait(value());
}

std::vector<PassTime> Ticket::times() const {
    PALPATE_ASSERT(recorded_->submitted);
    wait();
    std::vector<PassTime> times;
    for (Recorded::Part& part : recorded_->parts) {
        recorded_->read_times(part);
        times.insert(times.end(), part.times.begin(), part.times.end());
    }
    return times;
}

void Recorded::read_times(Part& part) const {
    if (std::exchange(part.has_times, true) || part.passes.empty())
        return;
    std::vector<uint64_t> stamps(2 * part.passes.size());
    check(
        vkGetQueryPoolResults(device->handle(), part.slot->queries(), 0,
                              static_cast<uint32_t>(stamps.size()), stamps.size() * 8,
                              stamps.data(), 8, VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
        "reading timestamps");
    const double ms_per_tick = static_cast<double>(device->limits().timestampPeriod) * 1e-6;
    for (size_t i = 0; i < part.passes.size(); ++i)
        if (!part.passes[i].for_profile_alone)
            part.times.push_back(
                {part.passes[i].name,
                 static_cast<double>(stamps[2 * i + 1] - stamps[2 * i]) * ms_per_tick});
    if (profile::on() && part.submitted_ns > 0)
        profile_passes(part, stamps);
}

// Times are those of the CPU's clock: as calibrated, or so that the last pass ends when the times
// are read. Work lies between its submission and that moment, so what rounding or calibration move
// beyond is moved back.
void Recorded::profile_passes(const Part& part, std::span<const uint64_t> stamps) const {
    const int64_t finished_ns = profile::now_ns();
    const double ns_per_tick = static_cast<double>(device->limits().timestampPeriod);
    const int64_t last_ns = device->cpu_ns_of(stamps.back()).value_or(finished_ns);
    const auto cpu_ns = [&](uint64_t stamp) {
        const double before = static_cast<double>(stamps.back() - stamp) * ns_per_tick;
        return std::clamp(last_ns - static_cast<int64_t>(before), part.submitted_ns, finished_ns);
    };
    for (size_t i = 0; i < part.passes.size(); ++i) {
        const Pass& pass = part.passes[i];
        const int64_t from = cpu_ns(stamps[2 * i]);
        const int64_t to = std::max(from, cpu_ns(stamps[2 * i + 1]));
        if (pass.copied_bytes > 0) {
            profile::add(profile::Track::copies, pass.name, from, to,
                         {{"bytes", pass.copied_bytes}});
            continue;
        }
        const double gpu_ms =
            static_cast<double>(stamps[2 * i + 1] - stamps[2 * i]) * ns_per_tick * 1e-6;
        profile::add(profile::Track::passes, pass.name, from, to, {{"gpu_ms", gpu_ms}});
        if (!pass.first_uses.empty())
            profile::add(profile::Track::compile, pass.first_uses, from, to);
    }
}

} // namespace palpate
