#pragma once

#include <span>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/setting.h"

namespace palpate {

// Settings that a person gave, for a struct that is known later.
template <class Struct>
class GivenSettings {
 public:
    // `setting` is of a table that stays.
    void give(const Setting<Struct>& setting, double value) {
        given_.emplace_back(&setting, value);
    }
    bool empty() const { return given_.empty(); }
    void apply(Struct& to) const {
        for (const auto& [setting, value] : given_)
            set(*setting, to, value);
    }

 private:
    std::vector<std::pair<const Setting<Struct>*, double>> given_;
};

// Fails with one sentence for the first setting whose value is not allowed. `what` has them, for
// the message.
template <class Struct>
Result<void> check_settings(const char* what, const Struct& in,
                            std::span<const Setting<Struct>> settings) {
    for (const Setting<Struct>& setting : settings)
        if (const double value = value_of(setting, in); !allows(setting, value))
            return fail("{}: {}: expected {}, found {}", what, setting.key, range_text(setting),
                        value);
    return {};
}

template <class Struct>
void write_settings(Json& out, const Struct& in, std::span<const Setting<Struct>> settings) {
    for (const Setting<Struct>& setting : settings)
        out[setting.key] = value_of(setting, in);
}

} // namespace palpate
