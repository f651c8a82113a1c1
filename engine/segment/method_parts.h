#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "engine/segment/map_values.h"
#include "engine/segment/methods.h"

// Parts that the runs of several methods share.
namespace palpate {

inline bool is_set(const ParameterValues& values, std::string_view name) {
    return !std::isnan(values.find(name)->second);
}
inline double value_of(const ParameterValues& values, std::string_view name) {
    return values.find(name)->second;
}

// Which label a field belongs to, sample by sample: of several fields the one with the least value.
class Winner {
 public:
    // A later field wins only where it is less. No data never wins.
    Result<void> add(uint16_t label, const Volume& field, const Task& task) {
        if (!best_) {
            best_ = field;
            PALPATE_TRY(owner_, map_values<uint16_t>(std::array{&field}, task, [=](auto v) {
                            return std::isnan(v[0]) ? uint16_t{0} : label;
                        }));
            return {};
        }
        const auto wins = [](float later, float best) {
            return later < best || (std::isnan(best) && !std::isnan(later));
        };
        PALPATE_TRY(Volume owner,
                    map_values<uint16_t>(std::array{&best(), &field, &owner()}, task, [&](auto v) {
                        return wins(v[1], v[0]) ? label : uint16_t(v[2]);
                    }));
        PALPATE_TRY(best_, map_values<float>(std::array{&best(), &field}, task, [&](auto v) {
                        return wins(v[1], v[0]) ? v[1] : v[0];
                    }));
        owner_ = std::move(owner);
        return {};
    }
    const Volume& best() const { return *best_; }
    const Volume& owner() const { return *owner_; }

 private:
    std::optional<Volume> best_, owner_;
};

// The labels of a winner where its field passes, in the type of the seeds.
template <class Passes>
Result<Volume> labels_of(const Winner& winner, const SegmentInput& input, const Task& task,
                         const Passes& passes) {
    const auto label = [&](std::array<float, 2> v) {
        return v[1] != float(input.background) && passes(v[0], uint16_t(v[1])) ? v[1] : 0.0f;
    };
    const std::array<const Volume*, 2> fields{&winner.best(), &winner.owner()};
    if (input.seeds->type() == ScalarType::u8)
        return map_values<uint8_t>(fields, task, [&](auto v) { return uint8_t(label(v)); });
    return map_values<uint16_t>(fields, task, [&](auto v) { return uint16_t(label(v)); });
}

} // namespace palpate
