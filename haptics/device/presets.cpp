#include "haptics/device/simulated.h"

namespace palpate::haptics {

// Masses, dampings and dry frictions lie in the ranges that studies of such devices give; encoder
// steps and limits are those of data sheets and open drivers. None is a promise about a product.
std::span<const DevicePreset> device_presets() {
    static const DevicePreset presets[] = {
        {"falcon",
         {.name = "simulated, Falcon-like",
          .workspace_m = glm::dvec3(0.05),
          .resolution_m = 48.5e-6,
          .max_force_n = 8.0,
          .max_stiffness_n_per_m = 3000.0,
          .max_damping_n_s_per_m = 20.0,
          .buttons = 4},
         {.mass_kg = 0.35, .damping_n_s_per_m = 0.6, .coulomb_n = 0.4, .encoder_step_m = 48.5e-6}},
        {"touch",
         {.name = "simulated, Touch-like",
          .workspace_m = glm::dvec3(0.08, 0.06, 0.035),
          .resolution_m = 55e-6,
          .max_force_n = 3.3,
          .max_stiffness_n_per_m = 700.0,
          .max_damping_n_s_per_m = 5.0,
          .buttons = 2,
          .senses_rotation = true},
         {.mass_kg = 0.045, .damping_n_s_per_m = 0.2, .coulomb_n = 0.1, .encoder_step_m = 55e-6}},
        {"omega",
         {.name = "simulated, omega-like",
          .workspace_m = glm::dvec3(0.08, 0.08, 0.055),
          .resolution_m = 10e-6,
          .max_force_n = 12.0,
          .max_stiffness_n_per_m = 5000.0,
          .max_damping_n_s_per_m = 40.0,
          .buttons = 1},
         {.mass_kg = 0.22, .damping_n_s_per_m = 0.5, .coulomb_n = 0.2, .encoder_step_m = 10e-6}},
        {"ideal",
         {.name = "simulated, without faults",
          .workspace_m = glm::dvec3(0.5),
          .max_force_n = 100.0,
          .max_torque_nm = 10.0,
          .max_stiffness_n_per_m = 1e5,
          .max_damping_n_s_per_m = 100.0,
          .buttons = 8,
          .senses_rotation = true},
         {.mass_kg = 0.2, .damping_n_s_per_m = 1.0}},
    };
    return presets;
}

const DevicePreset* find_device_preset(std::string_view name) {
    for (const DevicePreset& preset : device_presets())
        if (name == preset.name)
            return &preset;
    return nullptr;
}

} // namespace palpate::haptics
