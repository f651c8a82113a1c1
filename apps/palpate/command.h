#pragma once

#include <functional>
#include <vector>

#include "apps/palpate/named_files.h"
#include "engine/base/error.h"

namespace CLI {
class App;
}

namespace palpate {

// One sub-command: adds its options to `app` and returns what runs it, and which files its options
// name, of which main() lets none be written that another option names. An error is printed to
// standard error as one sentence, and the program exits with 1; wrong usage exits with 2.
//
// The files of a command that fails, or is interrupted, are not written: none of several takes its
// name before the command has succeeded. A command that sees to that itself, or whose work is not
// one thing, says `files_together = false`.
struct Command {
    std::function<Result<void>()> run;
    std::function<std::vector<NamedFile>()> files;
    bool files_together = true;
};

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
