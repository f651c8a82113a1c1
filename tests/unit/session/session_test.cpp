#include "engine/session/session.h"

#include <gmock/gmock.h>

#include "engine/edit/stroke_run.h"
#include "engine/surface/marching_cubes.h"
#include "tests/unit/session/session_work.h"

namespace palpate {
namespace {

SessionSetup setup() {
    Scene scene;
    scene.ray_cast.emplace();
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{300.0}};
    return {.document = head_and_organs(),
            .grey = "head",
            .labels = "organs",
            .scene = scene,
            .touch = {},
            .parameters = {.iso = 300.0},
            .mesh_iso = 300.0f,
            .edit = {.threaded = false}};
}

// What is felt, seen and meshed is the document, after everything a person does; and the whole is a
// function of what goes in.
TEST(Session, AllFollowTheDocument) {
    std::vector<std::string> states[2];
    std::vector<double> forces[2];
    for (int run = 0; run < 2; ++run) {
        Session session(setup());
        auto eye = session.add_eye();
        for (int n = 0; n < 20; ++n) {
            act(session, n);
            const auto sight = eye.look();
            const Document& document = sight.state.document;
            states[run].push_back(all_of(document));
            EXPECT_TRUE(sight.data.volume.is_same_as(*document.find("head")));
            EXPECT_TRUE(sight.data.labels->is_same_as(*document.find("organs")));
            const haptics::TouchScene felt = session.felt();
            EXPECT_TRUE(felt.grey->is_same_as(*document.find("head")));
            EXPECT_TRUE(felt.labels->is_same_as(*document.find("organs")));
            const Mesh mesh = session.mesh(), fresh = marching_cubes(sight.data.volume, 300.0f);
            EXPECT_EQ(mesh.positions, fresh.positions);
            EXPECT_EQ(mesh.triangles, fresh.triangles);
        }
    }
    EXPECT_EQ(states[0], states[1]);
}

// The stroke of a press is what apply_stroke() makes of the poses of its ticks.
TEST(Session, APressIsOneStroke) {
    Session session(setup());
    const Document before = session.state().document;
    stroke(session, 2);
    EXPECT_EQ(session.state().strokes_done, 1u);
    Operation cut;
    cut.kind = OperationKind::cut;
    cut.to_value = -98;
    std::vector<StrokePose> poses; // of ticks 10 to 29, along the path of stroke()
    for (int tick = 10; tick < 30; ++tick)
        poses.push_back({1e-3 * tick, {{0.5 * tick - 8.0, 2 - 5.0, 2 - 8.0}, {1, 0, 0, 0}}});
    const Volume expected = *apply_stroke(before.first(), {make_ball(3)}, cut, poses);
    EXPECT_EQ(content_hash(session.state().document.first()), content_hash(expected));
    EXPECT_NE(content_hash(before.first()), content_hash(expected));
}

TEST(Session, AStrokeUnderWayEndsWithTheDevice) {
    Session session(setup());
    const Stroke made = make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 3})", ""),
                                    {.kind = OperationKind::cut, .to_value = 5}, {{}});
    session.use({made.shape, made.tool, made.operation, "head", ""});
    const haptics::Workspace workspace({0, 0, 0}, 1.0);
    haptics::RecordedDevice device(
        {.workspace_m = glm::dvec3(1)},
        records_of_path(haptics::HandPath({{.buttons = 1}, {.time_s = 1, .buttons = 1}}), workspace,
                        1'000'000));
    const SessionDevice held{device, *haptics::find_algorithm("none"), workspace, {}, {}, {}};
    ASSERT_TRUE(session.start(held));
    EXPECT_FALSE(session.start(held)); // one at a time
    for (int64_t tick = 0; tick < 20; ++tick)
        session.tick(tick * 1'000'000, tick * 1'000'000);
    EXPECT_EQ(session.state().strokes_done, 0u);
    EXPECT_NE(all_of(session.state().document), all_of(head_and_organs())); // it shows already
    session.stop();
    session.settle();
    EXPECT_EQ(session.state().strokes_done, 1u);
    session.undo();
    session.settle();
    EXPECT_EQ(all_of(session.state().document), all_of(head_and_organs()));
}

TEST(Session, AnIsoValueIsOneForHandMeshAndPicture) {
    Session session(setup());
    auto eye = session.add_eye();
    session.set_iso(500.0);
    EXPECT_EQ(session.parameters().iso, 500.0);
    EXPECT_EQ(eye.look().scene.ray_cast->isos.front().value, 500.0);
    EXPECT_EQ(session.mesh().positions, marching_cubes(eye.look().data.volume, 500.0f).positions);
}

TEST(Session, SaysWhatWasRefused) {
    Session session(setup());
    session.undo();
    session.put({"a b", VolumeKind::other, head_and_organs().first()}, "x");
    session.settle();
    EXPECT_THAT(session.take_refusal(), testing::HasSubstr("found 'a b'"));
    EXPECT_EQ(session.take_refusal(), "");
    EXPECT_EQ(session.state().refusals, 2u);
}

// Devices come and go as often as one likes: their readers are given back.
TEST(Session, StartsAndStopsDevicesWithoutEnd) {
    SessionSetup threaded = setup();
    threaded.edit.threaded = true;
    Session session(std::move(threaded));
    const haptics::Workspace workspace({0, 0, 0}, 1.0);
    haptics::RecordedDevice device(
        {.workspace_m = glm::dvec3(1)},
        records_of_path(haptics::HandPath(std::vector<haptics::HandPose>(1)), workspace,
                        1'000'000));
    for (int n = 0; n < 40; ++n) {
        ASSERT_TRUE(session.start(
            {device, *haptics::find_algorithm("swept-point"), workspace, {}, {}, {}}));
        session.put({"x", VolumeKind::other, head_and_organs().first()}, "x");
        session.settle();
        session.stop();
    }
    EXPECT_EQ(session.state().strokes_done, 40u);
}

} // namespace
} // namespace palpate
