#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/base/json.h"
#include "engine/base/json_value.h"
#include "engine/edit/operation.h"
#include "engine/edit/sweep.h"

namespace palpate {

// One press of a tool: its shape, its operation and its path. A value: it can be stored, written,
// and applied again with the same result on any machine.
struct Stroke {
    Json shape; // as written; source of `tool`
    Tool tool;
    Operation operation;
    std::vector<StrokePose> poses; // at least one; time never falls
};

// Stroke files are JSON lines (docs/reference/strokes.md lists every key): a header line
//     {"stroke": 1, "units": "mm", "shape": {...}, "operation": {...}}
// then one pose a line, in world millimetres (LPS) and seconds:
//     {"t_s": 0.001, "p_mm": [1, 2, 3], "q": [1, 0, 0, 0]}
// The next header begins the next stroke. Empty lines are passed over. An error names the line.
Result<std::vector<Stroke>> parse_strokes(std::string_view text, const std::string& name);

// The same text again, but for blanks; every number keeps its bits.
std::string stroke_text(const Stroke& stroke);

// A shape by its JSON, such as {"kind": "ball", "radius_mm": 3}. Errors land in `in`'s list.
Tool read_tool(const JsonValue& in);
Operation read_operation(const JsonValue& in);
Json operation_json(const Operation& operation);

// A stroke from its parts. Refused: a shape that read_tool() refuses, no pose, time that falls.
Result<Stroke> make_stroke(Json shape, Operation operation, std::vector<StrokePose> poses);

} // namespace palpate
