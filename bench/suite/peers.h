#pragma once

#include "bench/suite/conversation.h"
#include "bench/suite/measure.h"
#include "engine/base/file.h"
#include "engine/volume/box.h"

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

// VTK, standing by: it is asked between our own frames, so that a machine that grows slower grows
// slower for both. What goes wrong on the way to VTK is no failure: absent_because says it, with
// the last line that VTK wrote, and there are no points from then on.
class Peers {
 public:
    // `steps` in the smallest spacing. Asked are subjects that name a mode of peers; scored those
    // whose shading is VTK's too: all but shaded alpha. Fails where files cannot be written.
    static Result<Peers> start(Bench& bench, const std::vector<Subject>& subjects,
                               const std::vector<double>& steps, Sampling sampling);

    // Begins with a subject: its first frames, pictures and errors.
    Result<void> open(const Subject& subject);

    // Times some frames of every step of the subject that was opened, for up to `budget_s` seconds
    // each.
    void time_frames(int frames, double budget_s);

    const std::string& version() const { return version_; } // "9.1.0"; empty where not asked
    const std::string& absent_because() const { return absent_because_; } // a sentence
    const std::vector<PeerPoint>& points() const { return points_; }

 private:
    struct Mapper {
        std::string name; // "gpu" or "fixed"
        Conversation vtk;
        size_t first_point = 0; // of the open subject
    };

    Peers(Bench& bench, std::vector<double> steps, Sampling sampling)
        : bench_(&bench), steps_(std::move(steps)), sampling_(sampling) {}
    void give_up(const Mapper& mapper, const Error& error);
    Result<void> score(PeerPoint& point, const std::string& file, const Subject& subject);

    Bench* bench_;
    std::vector<double> steps_;
    Sampling sampling_;
    std::string version_, absent_because_;
    std::vector<std::string> names_; // of the subjects asked
    std::vector<Mapper> mappers_;
    std::vector<PeerPoint> points_;
    bool open_ = false;
};

// Tools for peers: the interpreter of Debian's packages; a program run with its
// output in a file (its exit code, 127 where it does not exist); the last line that it said; and
// voxels as peers read them, raw with x fastest, told of in JSON.
inline const char* const kPython = "/usr/bin/python3";
int run_program(std::vector<std::string> command, const fs::path& output);
std::string last_line(const fs::path& file);
template <class T>
Result<void> save_samples(const Volume& volume, const fs::path& path) {
    std::vector<T> samples(sample_count(volume.grid()));
    read_box(volume, glm::ivec3(0), glm::ivec3(volume.size()), packed(volume.size()),
             samples.data());
    return save_bytes(path, std::as_bytes(std::span(samples)));
}
Result<Json> save_raw(const Sample& sample, const fs::path& path);

// Runs a script of bench/ with a display of its own; why there is no result, or nothing.
std::string run_vtk_script(Bench& bench, const std::string& script,
                           std::vector<std::string> arguments);

} // namespace palpate::bench
