#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "apps/palpate/interrupt.h"
#include "engine/io/volume_io.h"

namespace palpate {

// What the commands that read a volume have in common.
struct ReadFlags {
    std::string path;
    int64_t frame = -1;
    std::string series;
    double max_memory_mib = 0; // 0: the default of ReadOptions
};

// Adds the positional argument V and --frame, --series, --max-memory.
void add_read_flags(CLI::App& app, ReadFlags& flags);

// Loads, and prints the notes and warnings.
Result<LoadedVolume> load(const ReadFlags& flags, bool labels, const Interrupt& interrupt);

} // namespace palpate
