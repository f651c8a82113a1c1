#pragma once

#include <CLI/CLI.hpp>

#include "apps/palpate/touch_options.h"
#include "engine/volume/volume.h"
#include "haptics/device/registry.h"
#include "haptics/servo/touch_log.h"

// Warnings of `palpate touch`.
namespace palpate {

// Warns of options without an effect.
void warn_of_idle_options(const CLI::App& app, const TouchOptions& o,
                          const haptics::AlgorithmEntry& algorithm, haptics::TouchSource source,
                          const haptics::DeviceEntry& device);
// After the run: that nothing was felt, or late, and why.
void warn_of_what_was_felt(const haptics::TouchSummary& s, const TouchOptions& o,
                           const haptics::HandPath& path, const Grid& grid);
// After the run: that the edit changed no sample, and why.
void warn_of_idle_edit(const Volume& before, const Volume& after, const haptics::HandPath& path,
                       const TouchOptions& o);

} // namespace palpate
