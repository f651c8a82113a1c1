#pragma once

#include <functional>
#include <string>

#include "engine/io/volume_io.h"
#include "engine/program/interrupt.h"

namespace CLI {
class App;
}

namespace palpate {

// Options of all commands that read a volume.
struct ReadFlags {
    std::string path;
    int64_t frame = -1;
    std::string series;
    bool resample_slices = false;
    double max_memory_mib = 0;                    // 0: the default of ReadOptions
    std::function<void(double share)> progress{}; // ReadOptions

    uint64_t max_memory_bytes() const; // of max_memory_mib; 0: the default
};

// Adds --frame, --series, --resample-slices and --max-memory.
void add_read_limits(CLI::App& app, ReadFlags& flags);

// The same, and the positional argument V.
void add_read_flags(CLI::App& app, ReadFlags& flags);

// An error where a volume is expected and a name says that a mesh is there: what meshes are for.
Result<void> expect_no_mesh(const std::string& path);

ReadOptions read_options(const ReadFlags& flags, const std::stop_token& stop);

// Loads, and prints the notes and warnings.
Result<LoadedVolume> load(const ReadFlags& flags, bool labels, const std::stop_token& stop);
inline Result<LoadedVolume> load(const ReadFlags& flags, bool labels, const Interrupt& interrupt) {
    return load(flags, labels, interrupt.token());
}

} // namespace palpate
