#pragma once

#include <atomic>
#include <future>
#include <optional>

#include "engine/segment/simplex_mesh.h"

namespace palpate::view {

// A mesh at its making from a label, or on its way back into the labels.
struct MeshRun {
    struct Done { // one of the two
        std::optional<SimplexMesh> mesh;
        std::optional<Volume> labels;         // with the mesh in them
        uint64_t count_before = 0, count = 0; // of the label's samples
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
