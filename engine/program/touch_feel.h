#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "engine/program/named_files.h"
#include "engine/session/feel.h"
#include "haptics/proxy/algorithms.h"

namespace CLI {
class App;
}

namespace palpate {

// Options of `palpate touch` on the felt and edited data: grey values, labels, a mesh, a field.
struct FeelOptions {
    std::string source, mesh, felt_tool, tool, edit, second_tool, second_edit, guide;
    std::vector<std::string> label_feel, field;
    std::string transfer, transfer_across, opacity;
    double drill_mm = 0.0;
};
// clang-format off
inline constexpr Setting<FeelOptions> kFeelSettings[] = {
    {"drill_mm", &FeelOptions::drill_mm, 0, haptics::MostTouch::radius_mm, "mm",
     "Cut with a ball of this radius to the volume's lowest value; 0: do not cut",
     {.option = "drill"}},
};
// clang-format on
void add_feel_options(CLI::App& app, FeelOptions& options);

// Fails where options contradict one another whatever the scene.
Result<void> check_together(const FeelOptions& options, const std::string& algorithm);

// The files they name, for each_its_own().
void append_files(const FeelOptions& options, std::vector<NamedFile>& files);

// Makes all of it from what was loaded. `parameters` are those that need no more; `algorithm` says
// which of the parts are needed. An error names the option.
Result<Feel> make_feel(const FeelOptions& options, const LoadedScene& loaded,
                       haptics::TouchParameters parameters,
                       const haptics::AlgorithmEntry& algorithm, std::stop_token stop);

} // namespace palpate
