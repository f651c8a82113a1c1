#include <algorithm>
#include <cmath>

#include "bench/suite/touch.h"
#include "bench/touch/closed_loop.h"
#include "engine/image/png.h"

namespace palpate::bench {

namespace {

// Columns are stiffnesses, rising to the right; rows dampings, rising upwards.
Image picture_of(const std::vector<touch::ZWidthCell>& cells, uint32_t columns, uint32_t rows) {
    constexpr uint32_t kPixels = 24;
    Image picture = make_image({kPixels * columns, kPixels * rows}, {"R", "G", "B"});
    std::fill(picture.samples.begin(), picture.samples.end(), 0.9f); // between the cells
    for (size_t i = 0; i < cells.size(); ++i) {
        const auto column = static_cast<uint32_t>(i % columns);
        const auto row = static_cast<uint32_t>(rows - 1 - i / columns);
        // Green holds still; from yellow to red it shakes, by the logarithm of how much.
        const float shake = static_cast<float>(
            std::clamp(std::log10(std::max(cells[i].limit_cycle_mm, 1e-3) / 0.05) / 2.0, 0.0, 1.0));
        const glm::vec3 color = cells[i].stable ? glm::vec3(0.2f, 0.6f, 0.3f)
                                                : glm::vec3(0.9f, 0.75f - 0.65f * shake, 0.15f);
        for (uint32_t y = 1; y + 1 < kPixels; ++y)
            for (uint32_t x = 1; x + 1 < kPixels; ++x)
                for (size_t c = 0; c < 3; ++c)
                    picture.at(column * kPixels + x, row * kPixels + y, c) =
                        color[static_cast<int>(c)];
    }
    return picture;
}

Result<Json> map_of(const haptics::DevicePreset& preset, uint32_t delay_ticks,
                    const TouchPlan& plan, const Options& options) {
    haptics::DevicePreset device = preset;
    device.plant.delay_ticks = delay_ticks;
    const auto cells = touch::z_width("swept-point", device, plan.z_columns, plan.z_rows);
    const std::string name = fmt::format("z_width_{}_{}.png", preset.name, delay_ticks);
    PALPATE_TRY(save_png(options.out / name, picture_of(cells, plan.z_columns, plan.z_rows)));
    Json list = Json::array();
    double stiffest = 0.0;
    for (const touch::ZWidthCell& cell : cells) {
        stiffest = std::max(stiffest, cell.stable ? cell.stiffness_n_per_m : 0.0);
        list.push_back({{"stiffness_n_per_m", cell.stiffness_n_per_m},
                        {"damping_n_s_per_m", cell.damping_n_s_per_m},
                        {"limit_cycle_um", 1e3 * cell.limit_cycle_mm},
                        {"stable", cell.stable}});
    }
    return Json{{"device", preset.name},
                {"delay_ticks", delay_ticks},
                {"png", name},
                {"stiffest_stable_n_per_m", stiffest},
                {"cells", std::move(list)}};
}

} // namespace

Result<Json> touch_z_width(const TouchPlan& plan, const Options& options) {
    Json maps = Json::array();
    for (const uint32_t delay_ticks : {0u, 1u})
        for (const char* name : {"falcon", "touch", "omega"})
            if (const haptics::DevicePreset* preset = haptics::find_device_preset(name)) {
                PALPATE_TRY(Json map, map_of(*preset, delay_ticks, plan, options));
                maps.push_back(std::move(map));
            }
    return maps;
}

} // namespace palpate::bench
