#pragma once

#include <atomic>
#include <future>
#include <optional>

#include "engine/segment/simplex_mesh.h"

namespace palpate::view {

// A mesh at its making from a label, or labels at a change that takes a while.
struct MeshRun {
    struct Done { // one of the two
        std::optional<SimplexMesh> mesh;
        std::optional<Volume> labels{}; // as they become
        // Of the labels: the step's name in the list of edits, and what a person is told after the
        // label's new volume.
        const char *step = "", *told = "";
        bool is_of_mesh = false;              // that is pulled, and then is done with
        uint64_t count_before = 0, count = 0; // of the label's samples; run_mesh() counts
    };
    ~MeshRun() { stop.request_stop(); }
    Task task() {
        return {stop.get_token(), [this](double s) { share = s; }};
    }

    uint16_t label;
    Volume before; // the labels that it reads
    std::stop_source stop{};
    std::atomic<double> share{0.0};
    std::future<Result<Done>> done{}; // last: its thread ends before the rest goes
};

} // namespace palpate::view
