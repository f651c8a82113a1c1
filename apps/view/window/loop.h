#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "apps/view/script/script.h"
#include "apps/view/window/viewer.h"
#include "engine/base/json.h"

namespace palpate::view {

struct LoopOptions {
    std::string device; // DeviceOptions::select
    bool validate = false;
    glm::uvec2 size_px{1280, 800};
    double text_scale = 0.0;           // 0: as the display asks
    std::string record;                // a script to write; empty: none
    std::optional<Script> replay{};    // run_window() begins with
    double replay_speed = 1.0;         // times as fast as it was recorded
    std::optional<uint32_t> monitor{}; // that the window fills
    ViewerOptions viewer{};
    std::stop_token stop{};
    // Sets the renderer's options that depend on the device.
    std::function<void(const GpuDevice&, RendererOptions&)> set_renderer{};
};

// Opens a window and ends when a person closes it, with the state then.
Result<Json> run_window(Source source, LoopOptions options);

struct HeadlessResult {
    Json state;
    std::optional<Image> shot;
};
// Does a script without a window.
Result<HeadlessResult> run_headless(Source source, const Script& script, LoopOptions options,
                                    bool with_shot);

// The findings of measure_latency(), in a window or without one, beside the devices' names.
Result<Json> run_latency(Source source, LoopOptions options, bool headless);

// Options of a device that draws an interface without a window.
DeviceOptions headless_device(const std::string& select, bool validate);

} // namespace palpate::view
