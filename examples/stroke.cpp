// Cuts a groove into a volume with a stroke, and takes the stroke back.
//
//     example_stroke

#include <cstdio>

#include "engine/edit/history.h"
#include "engine/edit/stroke.h"
#include "engine/edit/stroke_run.h"
#include "engine/volume/changes.h"
#include "engine/volume/synthetic.h"

using namespace palpate;

// The text of a stroke file: a header in one line, then one pose a line, in mm of the patient.
constexpr const char* kStrokes =
    R"({"stroke": 1, "units": "mm", "shape": {"kind": "ball", "radius_mm": 4}, )"
    R"("operation": {"kind": "cut", "to_value": -1000}})"
    R"(
{"t_s": 0.0, "p_mm": [-30, -80, 0]}
{"t_s": 0.5, "p_mm": [30, -80, 0]}
)";

Result<void> run() {
    const Grid grid = make_grid(glm::uvec3(100), glm::dvec3(2.0), glm::dvec3(-99.0));
    const Volume before = synthetic::sample_ct_phantom(grid);

    const Result<std::vector<Stroke>> strokes = parse_strokes(kStrokes, "example");
    if (!strokes)
        return fail("{}", strokes.error().message);

    // A volume is a value: `before` stays as it is, `after` shares every brick that is the same.
    const Stroke& stroke = strokes->at(0);
    const Result<Volume> after = apply_stroke(before, stroke.tool, stroke.operation, stroke.poses);
    if (!after)
        return fail("{}", after.error().message);
    std::printf("value at (0, -80, 0) mm: %.0f before, %.0f after\n", before.value({50, 10, 50}),
                after->value({50, 10, 50}));
    std::printf("bricks changed: %zu\n", changed_bricks(before, *after).size());

    History history;
    history.record(before, *after);
    const Result<std::optional<Document>> undone = history.undo(*after);
    if (!undone)
        return fail("{}", undone.error().message);
    std::printf("bricks changed after undo: %zu\n",
                changed_bricks(before, (*undone)->first()).size());
    return {};
}

int main() {
    const Result<void> done = run();
    if (!done)
        std::fprintf(stderr, "%s\n", done.error().message.c_str());
    return done ? 0 : 1;
}
