#include "engine/segment/seed_values.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace palpate {

std::vector<SeedValues> seed_values(const Volume& volume, const Volume& seeds) {
    std::map<uint16_t, SeedValues> found;
    // Two passes: the mean, and then squares of what lies beside it.
    for (const bool is_second : {false, true}) {
        for_each_brick(seeds, [&](glm::uvec3 position) {
            const Brick& labels = seeds.brick(position);
            if (!(labels.range().max > 0.0f))
                return;
            const Brick& grey = volume.brick(position);
            const Brick::Pinned label_pin = labels.pin(), grey_pin = grey.pin();
            const glm::uvec3 valid = seeds.valid_in_brick(position);
            for (uint32_t z = 0; z < valid.z; ++z)
                for (uint32_t y = 0; y < valid.y; ++y)
                    for (uint32_t x = 0; x < valid.x; ++x) {
                        const uint32_t at = offset_in_brick({x, y, z});
                        const float label = labels.value(label_pin, at);
                        const double value = label > 0.0f ? grey.value(grey_pin, at) : NAN;
                        if (std::isnan(value))
                            continue;
                        SeedValues& of = found[static_cast<uint16_t>(label)];
                        if (is_second)
                            of.sd += (value - of.mean) * (value - of.mean);
                        else
                            ++of.count, of.mean += value;
                    }
        });
        for (auto& [label, of] : found)
            if (is_second)
                of.sd = std::sqrt(of.sd / double(of.count));
            else
                of.mean /= double(of.count);
    }
    std::vector<SeedValues> values;
    for (auto& [label, of] : found) {
        of.label = label;
        values.push_back(of);
    }
    return values;
}

double spread_of(const SeedValues& values, const Volume& volume) {
    const ValueRange range = volume.range();
    const double least = range.empty() ? 0.0 : (double(range.max) - double(range.min)) / 500.0;
    const double spread = std::max(values.sd, least);
    return spread > 0.0 ? spread : 1.0;
}

} // namespace palpate
