#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/json_value.h"
#include "engine/scene/transfer_function.h"

namespace palpate {

// Transfer functions that come with the program. Those for CT take Hounsfield units.
//   ct-bone         bone alone, dense bone brighter
//   ct-soft-tissue  skin as a veil, muscle and organs, bone
//   ct-vessels      contrast-filled vessels red, bone behind them
//   ct-skin         the outer surface of the body
//   ct-peer         the points that comparisons with VTK use
//   mr              MR has no unit: values are stretched over `range`, here 0 .. 1000 at first
const std::vector<std::string_view>& preset_names();

// Empty where there is no preset of that name.
std::optional<TransferFunction> preset(std::string_view name);

// All values moved so that 0 .. 1000 becomes low .. high: fits `mr` to a volume. low < high.
TransferFunction stretched(const TransferFunction& function, double low, double high);

// A JSON file (docs/scene.md, "Transfer functions"), or the name of a preset.
Result<TransferFunction> load_transfer_function(const std::filesystem::path& path);

// Reads a transfer function where a scene has one: a preset's name, a file's name relative to
// `folder`, a window, or the points themselves.
TransferFunction read_transfer_function(const JsonValue& value,
                                        const std::filesystem::path& folder);
Json transfer_function_json(const TransferFunction& function);

} // namespace palpate
