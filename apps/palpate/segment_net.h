#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "apps/palpate/seed_options.h"
#include "engine/base/error.h"
#include "engine/program/read_options.h"

namespace palpate {

// `palpate segment --method net`: a net on a server that a person names.
struct NetOptions {
    std::string send_to, key_file, model;
    bool consent = false;
    double timeout_s = 60.0;
};

// Whatever the method: their names, and what they are for.
void add_net_options(CLI::App& app, NetOptions& options);

// A line for each of its options, for --list.
std::string net_list_text();

// Asks the net and writes the labels. `background`: 0 for that of the seeds' file, if it has one.
Result<void> run_net(const NetOptions& options, const ReadFlags& read, const std::string& seeds,
                     const std::string& start, uint32_t background, const std::string& out);

} // namespace palpate
