// Touches and carves a volume at once, with undo: what the viewer and `palpate touch` stand on.
//
//     example_session

#include <cstdio>
#include <utility>

#include "engine/mesh/topology.h"
#include "engine/session/session.h"
#include "engine/volume/changes.h"
#include "engine/volume/synthetic.h"
#include "haptics/device/simulated.h"
#include "haptics/field/field.h"
#include "haptics/proxy/algorithms.h"

using namespace palpate;
namespace hp = palpate::haptics;

void print(const char* when, Session& session, const Volume& begin) {
    session.settle();
    std::printf("%s: %zu strokes, %zu bricks changed, mesh of %.0f mm^3\n", when,
                session.state().strokes_done,
                changed_bricks(begin, session.state().document.first()).size(),
                topology(session.mesh()).volume_mm3);
}

int main() {
    // A ball of radius 20 mm, values of 1000 in 0.
    const Grid grid = make_grid(glm::uvec3(96), glm::dvec3(0.5), glm::dvec3(-23.75));
    const Volume ball =
        synthetic::sample(synthetic::sphere({0, 0, 0}, 20.0, 0.5), grid, ScalarType::f32);

    // One document, seen, felt and meshed at the same iso-value. Without threads a session is a
    // function of its input; with them the servo ticks by the clock.
    SessionSetup setup{.document = Document(ball), .grey = "volume"};
    setup.parameters.iso = 500.0;
    hp::tune(setup.parameters, ball);
    setup.mesh_iso = 500.0f;
    setup.edit.threaded = false;
    Session session(std::move(setup));
    session.use({.shape = {{"kind", "ball"}, {"radius_mm", 3.0}},
                 .tool = {make_ball(3.0)},
                 .operation = {.kind = OperationKind::cut, .to_value = 0.0}});
    print("begin", session, ball);

    // The hand lands on the ball, presses button 0 for half a second, and leaves.
    const hp::HandPath path({{0.0, {{0, 0, 30}}},
                             {2.5, {{0, 0, 30}}},
                             {3.5, {{0, 0, 18}}, 1},
                             {4.0, {{0, 0, 18}}, 0},
                             {5.0, {{0, 0, 30}}}});
    const hp::Workspace workspace({0, 0, 20}, 1.0);
    hp::SimulatedDevice device(*hp::find_device_preset("omega"), {}, path, workspace);
    const Result<void> started =
        session.start({device, *hp::find_algorithm("swept-point"), workspace, {}, {}, {}});
    if (!started) {
        std::fprintf(stderr, "%s\n", started.error().message.c_str());
        return 1;
    }
    for (int64_t ms = 0; ms < 5000; ++ms)
        session.tick(ms * 1'000'000, ms * 1'000'000);
    session.stop();
    print("carved", session, ball);

    session.undo();
    print("undone", session, ball);
    return 0;
}
