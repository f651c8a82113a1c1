#include "engine/edit/edit_lag.h"

#include <algorithm>
#include <utility>

#include "engine/base/percentile.h"
#include "engine/base/profile.h"
#include "engine/edit/editor.h"

namespace palpate {

namespace {

constexpr std::array kKeys{"edit_to_texture_ms", "edit_to_mesh_ms", "edit_to_picture_ms"};
constexpr size_t kLeastKept = 10'000;
constexpr const char* kLagKey = "hand_eye_lag_snapshots";

EditLag::Figures figures_of(const std::vector<double>& values) {
    if (values.empty())
        return {};
    return {values.size(), percentile(values, 0.5), percentile(values, 0.99),
            percentile(values, 1.0)};
}

// Memory stays bounded in a session of days.
void keep(std::vector<double>& values, double value) {
    if (values.size() == 2 * kLeastKept)
        values.erase(values.begin(), values.begin() + kLeastKept);
    values.push_back(value);
}

} // namespace

void EditLag::reached(Reader reader, const EditState& state, int64_t at_ns) {
    const auto index = static_cast<size_t>(reader);
    const uint64_t felt = felt_.load(std::memory_order_acquire);
    const std::scoped_lock held(lock_);
    if (state.snapshot <= last_[index]) // the first snapshot, 0, is no edit
        return;
    last_[index] = state.snapshot;
    const double ms = 1e-6 * static_cast<double>(at_ns - state.newest_input_ns);
    const double ahead = static_cast<double>(std::max(felt, state.snapshot) - state.snapshot);
    // A command's snapshot has no newer input: nothing to count from.
    if (std::exchange(last_input_ns_[index], state.newest_input_ns) != state.newest_input_ns)
        keep(latencies_ms_[index], ms);
    if (reader == Reader::picture)
        keep(ahead_, ahead);
    profile::Scope scope("edit arrives");
    if (scope.recorded()) {
        scope.tell(kKeys[index], ms);
        scope.tell("snapshot", state.snapshot);
        if (reader == Reader::picture)
            scope.tell(kLagKey, ahead);
    }
}

EditLag::Figures EditLag::latency_ms(Reader reader) const {
    const std::scoped_lock held(lock_);
    return figures_of(latencies_ms_[static_cast<size_t>(reader)]);
}

EditLag::Figures EditLag::hand_eye_snapshots() const {
    const std::scoped_lock held(lock_);
    return figures_of(ahead_);
}

Json EditLag::json() const {
    Json all = Json::object();
    const auto add = [&](const char* key, const Figures& figures) {
        if (figures.count > 0)
            all[key] = {{"median", figures.median},
                        {"p99", figures.p99},
                        {"most", figures.most},
                        {"count", figures.count}};
    };
    for (const Reader reader : {Reader::texture, Reader::mesh, Reader::picture})
        add(kKeys[static_cast<size_t>(reader)], latency_ms(reader));
    add(kLagKey, hand_eye_snapshots());
    return all;
}

} // namespace palpate
