#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/json.h"
#include "engine/mesh/mesh.h"
#include "engine/volume/volume.h"

namespace palpate {

// Options of `palpate surface` for what is printed.
struct PrintFlags {
    std::vector<std::string> clips;
    bool largest_only = false;
    double least_ml = 0.0, scale = 1.0, wall_mm = 0.0;

    bool chooses_pieces() const { return largest_only || least_ml > 0.0; }
    bool shapes() const { return scale != 1.0 || wall_mm > 0.0; }
};
void add_print_flags(CLI::App& app, PrintFlags& flags);

// The volume, or label map, cut by the planes, if there are any.
Volume cut_for_print(const PrintFlags& flags, const Volume& volume, std::optional<double> iso);

Result<Json> choose_pieces(const PrintFlags& flags, Mesh& mesh);

// Scales and hollows.
Result<Json> shape_for_print(const PrintFlags& flags, Mesh& mesh, const std::stop_token& stop,
                             const std::function<void(double share)>& progress);

} // namespace palpate
