#pragma once

#include "bench/suite/measure.h"

namespace palpate::bench {

// VTK's two volume mappers on the scenes of a suite: timed and drawn by bench/peers_points.py, in
// the same run, scored here by the same errors.
struct PeerPoint {
    std::string subject; // its name
    std::string mapper;  // "gpu" or "fixed"
    double step_samples = 1.0;
    std::vector<double> wall_ms, cpu_ms;
    double first_frame_ms = 0;    // of the subject at its first step
    std::optional<Errors> errors; // absent where pictures cannot be held against each other
    Image picture;                // empty then

    std::string name() const; // "VTK GPU mapper, step 0.5"
};

struct Peers {
    std::string version;        // "9.1.0"; empty where VTK was not asked
    std::string absent_because; // a sentence, where there are no points
    std::vector<PeerPoint> points;
};

// What asking peers takes: the interpreter that Debian's packages are for; a program run with its
// output in a file (its exit code, 127 where it does not exist); the last line that it said; and
// voxels as peers read them, raw with x fastest, told of in JSON.
inline const char* const kPython = "/usr/bin/python3";
int run_program(std::vector<std::string> command, const fs::path& output);
std::string last_line(const fs::path& file);
Result<Value> save_raw(const Sample& sample, const fs::path& path);

// `steps` in the smallest spacing. Asked are subjects that name a mode of peers; scored those whose
// shading is VTK's too: all but shaded alpha. frames and budget_s are for each case and step. What
// goes wrong on the way to VTK is no failure: absent_because says it, and the last lines it wrote.
Result<Peers> measure_peers(Bench& bench, const std::vector<Subject>& subjects,
                            const std::vector<double>& steps, Sampling sampling, int frames,
                            double budget_s);

} // namespace palpate::bench
