#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "engine/edit/stroke.h"
#include "engine/session/session.h"
#include "engine/volume/builder.h"
#include "engine/volume/content_hash.h"
#include "haptics/device/recorded.h"
#include "tests/support/document_text.h"

// A session without threads, worked on as a person would, for tests.
namespace palpate {

inline Document head_and_organs() {
    const Grid grid = make_grid({48, 40, 36}, {0.5, 0.5, 1.0}, {-12, -10, -18});
    return *make_document(
        {{"head", VolumeKind::grey,
          make_volume(grid, ScalarType::i16,
                      [](glm::uvec3 i) { return (i.x * 7 + i.y * 13 + i.z * 29) % 997; })},
         {"organs", VolumeKind::labels, make_volume(grid, ScalarType::u8, [](glm::uvec3 i) {
              return (i.x / 9 + i.z / 7) % 4;
          })}});
}

// The n-th stroke: a cut in the head, or paint on the organs where the head has some values. The
// device's button is down for 20 ticks of 30; a device of its own each time.
inline void stroke(Session& session, int n, std::optional<double> surface_value = 300.0) {
    Operation operation;
    operation.kind = n % 2 ? OperationKind::draw : OperationKind::cut;
    operation.label = static_cast<uint16_t>(1 + n % 9);
    operation.to_value = -100 + n;
    operation.surface_value = surface_value;
    if (n % 2)
        operation.only_values = {200, 800};
    const Stroke made =
        *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 3})", ""), operation, {{}});
    ASSERT_TRUE(session.use(
        {made.shape, made.tool, made.operation, n % 2 ? "organs" : "head", n % 2 ? "head" : ""}));
    std::vector<haptics::HandPose> poses;
    for (int k = 0; k < 4; ++k)
        poses.push_back(
            {.time_s = 0.01 * k,
             .tool = {.position_mm = {double(5 * k - 8), double(n % 11 - 5), double(n % 17 - 8)}},
             .buttons = k > 0 && k < 3 ? 1u : 0u});
    const haptics::Workspace workspace({0, 0, 0}, 1.0);
    haptics::RecordedDevice device(
        {.workspace_m = glm::dvec3(1)},
        records_of_path(haptics::HandPath(std::move(poses)), workspace, 1'000'000));
    ASSERT_TRUE(session.start({device, *haptics::find_algorithm("none"), workspace, {}, {}, {}}));
    for (int64_t tick = 0; tick < 30; ++tick)
        session.tick(tick * 1'000'000, tick * 1'000'000);
    session.stop();
    session.settle();
    ASSERT_EQ(session.take_refusal(), "");
}

// The n-th thing a person does; each is one step.
inline void act(Session& session, int n) {
    const Document now = session.state().document;
    switch (n % 7) {
        case 2:
            ASSERT_TRUE(session.undo());
            break;
        case 3:
            if (n % 2) {
                ASSERT_TRUE(session.redo());
                break;
            }
            [[fallthrough]];
        case 5: // a filter's result, which may have a grid of its own
            ASSERT_TRUE(session.put(
                {"result", VolumeKind::other,
                 make_volume(make_grid({20, 20, uint32_t(10 + n % 5)}, {1, 1, 1}), ScalarType::f32,
                             [n](glm::uvec3 i) { return 0.1 * i.x * n; })},
                "gaussian", Json{{"sigma_mm", 0.1 * n}}));
            break;
        default:
            stroke(session, n);
            return;
    }
    session.settle();
    ASSERT_EQ(session.take_refusal(), "");
}

} // namespace palpate
