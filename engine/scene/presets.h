#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/json_value.h"
#include "engine/scene/transfer_function.h"
#include "engine/volume/grid.h"

namespace palpate {

// Transfer functions that come with the program. Those for CT take Hounsfield units.
//   ct-bone         bone alone, dense bone brighter
//   ct-soft-tissue  skin as a veil, muscle and organs, bone
//   ct-vessels      contrast-filled vessels red, bone behind them
//   ct-skin         the outer surface of the body
//   ct-peer         the points that comparisons with VTK use
//   mr              MR has no unit: values are stretched over `range`, here 0 .. 1000 at first
const std::vector<std::string_view>& preset_names();

// A window of CT by the name radiologists know, Hounsfield units.
struct WindowPreset {
    const char* name;
    double level, width;
};
// Common settings (Radiopaedia, "Windowing (CT)"); hospitals differ by some tens of HU.
std::span<const WindowPreset> window_presets();

// Empty where there is no preset of that name. Opacities are per millimetre, as suits a body of
// common size.
std::optional<TransferFunction> preset(std::string_view name);

// The opacity_unit_mm of presets on a volume: 1 where the diagonal of its box of voxels is 200 to
// 2000 mm long, from a cropped head to a whole body; 1/200 of a shorter diagonal, 1/2000 of a
// longer one. So a tooth, a mouse or a model in metres is as opaque as the same body at that size.
double preset_unit_mm(const Grid& grid);

// The function with the unit of presets where it leaves its own open (opacity_unit_mm is 0).
TransferFunction sized(TransferFunction function, const Grid& grid);

// All values moved so that 0 .. 1000 becomes low .. high, rising or falling: fits `mr` to a volume.
TransferFunction stretched(const TransferFunction& function, double low, double high);

// A JSON file (docs/reference/scene.md, "Transfer functions"), or the name of a preset. As
// read_transfer_function().
Result<TransferFunction> load_transfer_function(const std::filesystem::path& path);

// The text of such a file; `name` is for messages.
Result<TransferFunction> parse_transfer_function(std::string_view text, const std::string& name);

// Reads a transfer function where a scene has one: a preset's name, a file's name relative to
// `folder`, a window, or the points themselves. A preset without a unit has opacity_unit_mm 0:
// sized() chooses it from the volume.
TransferFunction read_transfer_function(const JsonValue& value,
                                        const std::filesystem::path& folder);
Json transfer_function_json(const TransferFunction& function);

} // namespace palpate
