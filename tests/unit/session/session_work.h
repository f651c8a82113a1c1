#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "engine/edit/stroke.h"
#include "engine/session/notes.h"
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

// The notes after the n-th thing: something of each kind but bounds.
inline NotePages::Texts notes_of_act(int n) {
    Notes notes;
    notes.measures = {{MeasureKind::ruler, {{1, 2, 3}, {4, 5, 6.5 + n}}, fmt::format("r{}", n)}};
    notes.label_names = {{uint32_t(1 + n), "liver", glm::dvec3(0.5, 0.25, 1.0)}};
    notes.label_styles = {{uint32_t(2 + n), {{0.1, 0.2, 0.3}, n % 2 == 0}}};
    notes.locked_labels = {uint16_t(1 + n)};
    notes.clip_planes = {{{double(n), 2, 3}, {0, 0, 1}}};
    NotePages::Texts pages = pages_of(notes).texts();
    pages.erase("bound");
    pages.erase("window");
    return pages;
}

inline NotePages::Texts bound_of_act(int n) {
    Notes notes;
    notes.bound = {"fast-marching", "0123456789abcdef", 0.1 * n};
    return {{"bound", pages_of(notes).texts().at("bound")}};
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
        case 5: // a filter's result, which may have a grid of its own, and a bound
            ASSERT_TRUE(session.put(
                {"result", VolumeKind::other,
                 make_volume(make_grid({20, 20, uint32_t(10 + n % 5)}, {1, 1, 1}), ScalarType::f32,
                             [n](glm::uvec3 i) { return 0.1 * i.x * n; })},
                "gaussian", Json{{"sigma_mm", 0.1 * n}}, bound_of_act(n)));
            break;
        case 6: // planes, locks, names, looks and measures
            ASSERT_TRUE(session.note(notes_of_act(n), "notes"));
            break;
        default:
            stroke(session, n);
            return;
    }
    session.settle();
    ASSERT_EQ(session.take_refusal(), "");
}

} // namespace palpate
