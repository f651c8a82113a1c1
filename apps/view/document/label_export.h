#pragma once

#include <filesystem>
#include <future>
#include <stop_token>
#include <string>

#include "engine/base/error.h"
#include "engine/volume/volume.h"

namespace palpate::view {

// Writes labels as a file of the kind that its name says: a volume with all of them, or, of a mesh
// (.ply, .stl, .obj, .vtp), the surface of one label, smoothed within 0.375 of a sample
// (surface_nets()). Says what was written. An error where no sample has the label, or the file
// cannot be written; then there is none.
Result<std::string> export_labels(const Volume& labels, uint16_t label,
                                  const std::filesystem::path& path, const std::stop_token& stop);

// Under way on a thread of its own.
struct LabelExport {
    ~LabelExport() { stop.request_stop(); }

    std::stop_source stop{};
    std::future<Result<std::string>> done{}; // last: its thread ends before the rest goes
};

} // namespace palpate::view
