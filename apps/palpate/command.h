#pragma once

#include "engine/program/command.h"

namespace CLI {
class App;
}

// The sub-commands: each adds its options to `app`.
namespace palpate {

Command add_batch(CLI::App& app);
Command add_info(CLI::App& app);
Command add_convert(CLI::App& app);
Command add_filter(CLI::App& app);
Command add_edit(CLI::App& app);
Command add_project(CLI::App& app);
Command add_render(CLI::App& app);
Command add_compare(CLI::App& app);
Command add_devices(CLI::App& app);
Command add_doctor(CLI::App& app);
Command add_bench(CLI::App& app); // starts palpate-bench
Command add_bench_suites(CLI::App& app);
Command add_measure(CLI::App& app);
Command add_seeds(CLI::App& app);
Command add_segment(CLI::App& app);
Command add_surface(CLI::App& app);
Command add_touch(CLI::App& app);
Command add_view(CLI::App& app);

} // namespace palpate
