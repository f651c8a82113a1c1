#include "engine/session/session.h"

#include <gmock/gmock.h>

#include <atomic>
#include <stdexcept>

#include "engine/edit/stroke_run.h"
#include "engine/session/feel.h"
#include "engine/surface/marching_cubes.h"
#include "haptics/proxy/tool_points.h"
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

// The document is what is felt, seen and meshed, after everything a person does; and the whole is a
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
    session.set_iso(450.0); // which smooth walls take where the operation has no value
    const Document before = session.state().document;
    stroke(session, 2, {});
    EXPECT_EQ(session.state().strokes_done, 1u);
    Operation cut;
    cut.kind = OperationKind::cut;
    cut.to_value = -98;
    cut.surface_value = 450.0;
    std::vector<StrokePose> poses; // of ticks 10 to 29, along the path of stroke()
    for (int tick = 10; tick < 30; ++tick)
        poses.push_back({1e-3 * tick, {{0.5 * tick - 8.0, 2 - 5.0, 2 - 8.0}, {1, 0, 0, 0}}});
    const Volume expected = *apply_stroke(before.first(), {make_ball(3)}, cut, poses);
    EXPECT_EQ(content_hash(session.state().document.first()), content_hash(expected));
    EXPECT_NE(content_hash(before.first()), content_hash(expected));
}

// The print of drill-three-step: no button, but a distance of more than the threshold from surface
// to hand begins to remove material, and where the hand is.
TEST(Session, DrillingInThreeStepsRemovesMaterialWhereTheHandIs) {
    const Volume block = make_volume(make_grid(glm::uvec3(40), glm::dvec3(0.5)), ScalarType::i16,
                                     [](glm::uvec3 i) { return i.z < 24 ? 1000.0 : 0.0; });
    const Document before(block, VolumeKind::grey);
    for (const double depth_mm : {1.5, 6.0}) { // from the surface, about z = 11.75 mm
        SessionSetup begin = setup();
        begin.document = before;
        begin.grey = before.volumes.front().name;
        begin.labels.clear();
        begin.parameters = {.iso = 500.0, .drill_threshold_mm = 2.0};
        Session session(std::move(begin));
        const Stroke made = *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 1.5})", ""),
                                         {.kind = OperationKind::cut, .to_value = 0}, {{}});
        session.use({made.shape, made.tool, made.operation, "", ""});
        const haptics::Workspace workspace({10, 10, 10}, 1.0);
        haptics::RecordedDevice device(
            {.workspace_m = glm::dvec3(1)},
            records_of_path(
                haptics::HandPath(
                    {{.tool = {.position_mm = {10, 10, 14}}},
                     {.time_s = 0.5, .tool = {.position_mm = {10, 10, 11.75 - depth_mm}}}}),
                workspace, 1'000'000));
        ASSERT_TRUE(session.start(
            {device, *haptics::find_algorithm("drill-three-step"), workspace, {}, {}, {}}));
        std::vector<StrokePose> poses;
        for (int64_t tick = 0; tick < 500; ++tick) {
            const haptics::ServoTick t = session.tick(tick * 1'000'000, tick * 1'000'000);
            if (t.touched.carving == haptics::Carving::at_tool)
                poses.push_back({1e-9 * static_cast<double>(t.now_ns), t.tool});
        }
        session.stop();
        session.settle();
        const Volume after = session.state().document.first();
        if (depth_mm < 2.0) {
            EXPECT_TRUE(poses.empty());
            EXPECT_EQ(content_hash(after), content_hash(block));
            continue;
        }
        ASSERT_FALSE(poses.empty());
        // The volume that a ball swept along the hand's way removes, from 2 mm of depth to the end:
        // with the half balls at both ends, to a shell of half a sample.
        double removed_mm3 = 0.0;
        for (uint32_t i = 0; i < 40 * 40 * 40; ++i) {
            const glm::uvec3 at(i % 40, i / 40 % 40, i / 1600);
            removed_mm3 += block.value(at) >= 500.0f && after.value(at) < 500.0f ? 0.125 : 0.0;
        }
        constexpr double kPi = 3.14159265358979, kRadius = 1.5;
        const double way_mm = depth_mm - 2.0;
        const double swept_mm3 =
            kPi * kRadius * kRadius * way_mm + 4.0 / 3.0 * kPi * kRadius * kRadius * kRadius;
        const double shell_mm3 =
            0.25 * (2.0 * kPi * kRadius * way_mm + 4.0 * kPi * kRadius * kRadius);
        EXPECT_NEAR(removed_mm3, swept_mm3, shell_mm3);
        EXPECT_NEAR(poses.front().tool.position_mm.z, 11.75 - 2.0, 0.1);
        while (session.state().undo_steps > 0) {
            session.undo();
            session.settle();
        }
        EXPECT_EQ(content_hash(session.state().document.first()), content_hash(block));
    }
}

TEST(Session, OneDamagedVoxelLeavesTheDefaultIsoValueAmidTheOthers) {
    for (const double astray : {3e38, -3e38, 1e12, 1000.0}) {
        const auto value = [&](glm::uvec3 i) {
            return i == glm::uvec3(3, 4, 5) ? astray : i.x < 8 ? 100.0 : 500.0;
        };
        const LoadedScene loaded{.data = {make_volume(make_grid(glm::uvec3(16), glm::dvec3(1.0)),
                                                      ScalarType::f32, value),
                                          {},
                                          {}}};
        EXPECT_EQ(default_iso(loaded), astray == 1000.0 ? 550.0 : 300.0) << astray;
    }
}

TEST(Session, AStrokeUnderWayEndsWithTheDevice) {
    Session session(setup());
    const Stroke made = *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 3})", ""),
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
    Scene live = session.scene();
    live.surfaces.resize(1);
    live.surfaces[0].live_iso = 500.0;
    session.show(live);
    session.set_iso(600.0);
    EXPECT_EQ(eye.look().scene.surfaces[0].live_iso, 600.0);
    EXPECT_EQ(eye.look().data.meshes.size(), 1u);
}

TEST(Session, OfSeveralSurfacesTheFeltOneMovesAndTheyStaySorted) {
    Session session(setup());
    const auto values = [&] {
        std::vector<double> all;
        for (const IsoSurface& iso : session.scene().ray_cast->isos)
            all.push_back(iso.value);
        return all;
    };
    Scene scene = session.scene();
    scene.ray_cast->isos = {{-300.0}, {100.0}, {300.0}};
    session.show(scene);
    session.set_iso(300.0);
    EXPECT_EQ(values(), (std::vector<double>{-300.0, 100.0, 300.0}));
    session.set_iso(50.0); // bone goes below the one between
    EXPECT_EQ(values(), (std::vector<double>{-300.0, 50.0, 100.0}));
    session.set_iso(-300.0); // where skin is
    EXPECT_EQ(values(), (std::vector<double>{-300.0, 50.0, 100.0}));
    EXPECT_EQ(session.parameters().iso, -300.0);
}

TEST(Session, SaysWhatWasRefused) {
    Session session(setup());
    session.undo();
    session.put({"a b", VolumeKind::other, head_and_organs().first()}, "x");
    session.settle();
    EXPECT_EQ(session.take_refusal(), "nothing is left to undo");
    EXPECT_THAT(session.take_refusal(), testing::HasSubstr("found 'a b'"));
    EXPECT_EQ(session.take_refusal(), "");
    EXPECT_EQ(session.state().refusals, 2u);
}

// With threads and without: what is seen, felt and meshed is chosen by name.
TEST(Session, WhatIsSeenAndFeltIsChosen) {
    for (const bool threaded : {false, true}) {
        SessionSetup begin = setup();
        begin.edit.threaded = threaded;
        begin.document = with_volume(
            begin.document, {"other", VolumeKind::grey,
                             make_volume(make_grid({30, 20, 20}, {1, 1, 1}), ScalarType::i16,
                                         [](glm::uvec3 i) { return 40.0 * i.x; })});
        Session session(std::move(begin));
        auto eye = session.add_eye();
        const auto tool = std::make_shared<const haptics::ToolPoints>();
        for (int n = 0; n < 20; ++n) {
            const uint64_t version = session.felt().version;
            const char* name = n % 2 ? "head" : "other";
            session.choose({name, n % 3 ? "organs" : "", {.tool = n % 2 ? tool : nullptr}});
            session.settle();
            const Document document = session.state().document;
            const auto sight = eye.look();
            EXPECT_TRUE(sight.data.volume.is_same_as(*document.find(name)));
            EXPECT_EQ(sight.data.labels.has_value(), n % 3 > 0);
            const haptics::TouchScene felt = session.felt();
            EXPECT_TRUE(felt.grey->is_same_as(*document.find(name)));
            EXPECT_EQ(felt.labels.has_value(), n % 3 > 0);
            EXPECT_EQ(felt.tool, n % 2 ? tool : nullptr);
            EXPECT_GT(felt.version, version); // by which algorithms know of the tool
            EXPECT_EQ(session.mesh().positions,
                      marching_cubes(*document.find(name), 300.0f).positions);
        }
        session.choose({}); // nothing: the first volume is seen, and none is felt or meshed
        session.settle();
        EXPECT_TRUE(eye.look().data.volume.is_same_as(session.state().document.first()));
        EXPECT_FALSE(session.felt().grey);
        EXPECT_TRUE(session.mesh().positions.empty());
    }
}

// A hand at rest in the material: whatever is chosen meanwhile, the force does not jump, and the
// workspace turns under it without one.
TEST(Session, WhatIsChosenUnderAPressedHandMakesNoJump) {
    const Grid grid = make_grid(glm::uvec3(48), glm::dvec3(1), glm::dvec3(-23.5));
    const auto floor_at = [&](double z_mm) { // solid below
        return make_volume(grid, ScalarType::i16,
                           [&](glm::uvec3 i) { return 500.0 + 100.0 * (z_mm - (i.z - 23.5)); });
    };
    SessionSetup begin = setup();
    begin.document = *make_document(
        {{"low", VolumeKind::grey, floor_at(0.0)}, {"high", VolumeKind::grey, floor_at(3.0)}});
    begin.grey = "low";
    begin.labels = "";
    begin.parameters = {.iso = 500.0, .stiffness_n_per_m = 500.0};
    begin.mesh_iso.reset();
    Session session(std::move(begin));
    const haptics::Workspace workspace({0, 0, 0}, 1.0);
    haptics::RecordedDevice device(
        {.workspace_m = glm::dvec3(0.05), .max_force_n = 8},
        records_of_path(haptics::HandPath({{.tool = {.position_mm = {0, 0, 8}}},
                                           {.time_s = 2.5, .tool = {.position_mm = {0, 0, 8}}},
                                           {.time_s = 3.0, .tool = {.position_mm = {0, 0, -2}}},
                                           {.time_s = 5.0, .tool = {.position_mm = {0, 0, -2}}}}),
                        workspace, 1'000'000));
    ASSERT_TRUE(
        session.start({device, *haptics::find_algorithm("swept-point"), workspace, {}, {}, {}}));
    haptics::ServoTick before;
    for (int64_t tick = 0; tick < 4800; ++tick) {
        if (tick == 3200)
            session.choose({"high", "", {}});
        if (tick == 3600)
            session.choose({"low", "", {}});
        if (tick == 3900) {
            Camera camera;
            camera.eye_mm = {300, 0, 0};
            session.align_workspace(camera);
            EXPECT_NEAR(glm::dot(session.workspace().rotation, session.workspace().rotation), 1.0,
                        1e-12);
        }
        const haptics::ServoTick now = session.tick(tick * 1'000'000, tick * 1'000'000);
        if (tick >= 3200) { // the hand rests: all that is left is the fade, 0.09 N a tick
            ASSERT_LE(glm::distance(now.rendered_world_n, before.rendered_world_n), 0.09 + 1e-9)
                << tick;
            ASSERT_LE(glm::distance(now.sent_world_n, before.sent_world_n), 0.09 + 1e-9) << tick;
        }
        if (tick == 3199) {
            EXPECT_NEAR(now.sent_world_n.z, 1.0, 0.02); // 2 mm deep
        }
        if (tick == 3599) {
            EXPECT_NEAR(now.sent_world_n.z, 2.5, 0.02); // 5 mm
        }
        before = now;
    }
    EXPECT_NEAR(before.sent_world_n.z, 1.0, 0.02);
    EXPECT_EQ(session.device_report().force, haptics::SoftStart::Mode::running);
    EXPECT_EQ(session.device_report().ticks, 4800u);
    session.stop();
    EXPECT_FALSE(session.device_report().running);
    EXPECT_THAT(session.calibrate().error().message, testing::HasSubstr("calibration"));
}

// Says that it is not homed until home() has been called.
struct Unhomed final : haptics::HapticDevice {
    haptics::DeviceCapabilities can{
        .name = "unhomed", .workspace_m = glm::dvec3(1), .needs_homing = true};
    int homed = 0;
    bool has_homing = true;
    const haptics::DeviceCapabilities& capabilities() const noexcept override { return can; }
    Result<void> home() override {
        if (!has_homing)
            return fail("unhomed: it has no homing");
        ++homed;
        return {};
    }
    haptics::DeviceStatus read(int64_t, haptics::DeviceSample&) noexcept override {
        return homed ? haptics::DeviceStatus::ok : haptics::DeviceStatus::not_homed;
    }
    haptics::DeviceStatus write(int64_t, const haptics::Wrench&) noexcept override {
        return haptics::DeviceStatus::ok;
    }
    void halt(int64_t) noexcept override {}
};

TEST(Session, HomesADeviceOnce) {
    Session session(setup());
    Unhomed device;
    const haptics::Workspace workspace({0, 0, 0}, 1.0);
    const SessionDevice held{device, *haptics::find_algorithm("none"), workspace, {}, {}, {}};
    EXPECT_FALSE(session.calibrate()); // there is none
    device.has_homing = false;
    EXPECT_FALSE(session.start(held));
    device.has_homing = true;
    for (int n = 0; n < 3; ++n) {
        ASSERT_TRUE(session.start(held));
        EXPECT_FALSE(session.calibrate()); // it runs
        session.stop();
    }
    EXPECT_EQ(device.homed, 1);
}

// Two buttons, two tools on two volumes: each press is a stroke with the tool of its button, the
// one that was pressed first where both are.
TEST(Session, TwoButtonsCarveWithTwoTools) {
    Session session(setup());
    const Stroke cut = *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 3})", ""),
                                    {.kind = OperationKind::cut, .to_value = 5}, {{}});
    const Stroke draw = *make_stroke(*parse_json(R"({"kind": "ball", "radius_mm": 2})", ""),
                                     {.kind = OperationKind::draw, .label = 9}, {{}});
    ASSERT_TRUE(session.use({cut.shape, cut.tool, cut.operation, "head", ""}));
    ASSERT_TRUE(session.use({draw.shape, draw.tool, draw.operation, "organs", ""}, 1));
    const haptics::Workspace workspace({0, 0, 0}, 1.0);
    std::vector<haptics::HandPose> poses;
    const uint32_t buttons[] = {0, 1, 0, 2, 3, 2, 0, 1, 3, 0}; // each for 10 ticks
    for (int i = 0; i < 100; ++i)
        poses.push_back({.time_s = 1e-3 * i,
                         .tool = {.position_mm = {0.1 * i - 5.0, 0, 0}},
                         .buttons = buttons[i / 10]});
    haptics::RecordedDevice device({.workspace_m = glm::dvec3(1)},
                                   records_of_path(haptics::HandPath(poses), workspace, 1'000'000));
    const Document before = session.state().document;
    ASSERT_TRUE(session.start(
        {device, *haptics::find_algorithm("none"), workspace, {.second_button = 1}, {}, {}}));
    std::vector<size_t> strokes;
    for (int64_t tick = 0; tick < 100; ++tick) {
        session.tick(tick * 1'000'000, tick * 1'000'000);
        if (tick % 10 == 9)
            strokes.push_back(session.state().strokes_done);
    }
    session.stop();
    session.settle();
    EXPECT_EQ(strokes, (std::vector<size_t>{0, 0, 1, 1, 1, 1, 2, 2, 2, 3}));
    const auto swept = [&](const Stroke& with, const Volume& volume, int first, int last) {
        std::vector<StrokePose> path;
        for (int i = first; i <= last; ++i)
            path.push_back({1e-3 * i, {poses[size_t(std::min(i, last))].tool}});
        return *apply_stroke(volume, with.tool, with.operation, path);
    };
    const Volume organs = swept(draw, *before.find("organs"), 30, 59);
    EXPECT_EQ(content_hash(*session.state().document.find("organs")), content_hash(organs));
    EXPECT_NE(content_hash(organs), content_hash(*before.find("organs")));
    session.lay_down(0); // its button does nothing from now on
    session.undo();
    session.undo();
    session.undo();
    session.settle();
    EXPECT_EQ(all_of(session.state().document), all_of(before));
}

// A wall that the hand rests in, and what was written to the device last.
struct Pressing final : haptics::HapticDevice {
    haptics::DeviceCapabilities can{.workspace_m = glm::dvec3(0.05), .max_force_n = 8};
    glm::dvec3 position_m{0, 0, 8e-3};
    haptics::DeviceStatus status = haptics::DeviceStatus::ok;
    std::atomic<double> force_n{0.0};
    const haptics::DeviceCapabilities& capabilities() const noexcept override { return can; }
    haptics::DeviceStatus read(int64_t now_ns, haptics::DeviceSample& sample) noexcept override {
        sample.time_ns = now_ns;
        sample.position_m = position_m;
        return status;
    }
    haptics::DeviceStatus write(int64_t, const haptics::Wrench& wrench) noexcept override {
        force_n = glm::length(wrench.force_n);
        return haptics::DeviceStatus::ok;
    }
    void halt(int64_t) noexcept override { force_n = 0.0; }
};

class PressedSession : public testing::Test {
 protected:
    PressedSession() {
        SessionSetup begin = setup();
        begin.document = *make_document(
            {{"floor", VolumeKind::grey,
              make_volume(make_grid(glm::uvec3(48), glm::dvec3(1), glm::dvec3(-23.5)),
                          ScalarType::i16,
                          [&](glm::uvec3 i) { return 500.0 + 100.0 * (23.5 - i.z); })}});
        begin.grey = "floor";
        begin.labels = "";
        begin.parameters = {.iso = 500.0, .stiffness_n_per_m = 500.0};
        begin.mesh_iso.reset();
        session = std::make_unique<Session>(std::move(begin));
        EXPECT_TRUE(session->start({device,
                                    *haptics::find_algorithm("swept-point"),
                                    haptics::Workspace({0, 0, 0}, 1.0),
                                    {},
                                    {},
                                    {},
                                    /*armed=*/false}));
    }
    void ticks(int count) {
        for (int i = 0; i < count; ++i, now_ns += 1'000'000)
            session->tick(now_ns, now_ns);
    }
    // 1 N, 2 mm deep.
    void press() {
        session->arm();
        ticks(2500);
        for (int i = 0; i <= 1000; ++i) {
            device.position_m.z = 8e-3 - 10e-6 * i;
            ticks(1);
        }
        ASSERT_NEAR(device.force_n, 1.0, 0.05);
    }
    Pressing device;
    std::unique_ptr<Session> session;
    int64_t now_ns = 0;
};

TEST_F(PressedSession, AForceComesOnlyAfterAPersonHasArmedAndEndsWithTheTickAfterDisarming) {
    device.position_m.z = -2e-3;
    ticks(3000);
    EXPECT_EQ(device.force_n, 0.0);
    EXPECT_EQ(session->device_report().force, haptics::SoftStart::Mode::disarmed);
    device.position_m.z = 8e-3;
    ticks(10);
    press();
    session->disarm();
    ticks(1);
    EXPECT_EQ(device.force_n, 0.0);
    ticks(3000);
    EXPECT_EQ(device.force_n, 0.0);
}

TEST_F(PressedSession, AForceEndsWithTheTickInWhichTheDeviceIsGone) {
    press();
    device.status = haptics::DeviceStatus::gone;
    ticks(1);
    EXPECT_EQ(device.force_n, 0.0);
    device.status = haptics::DeviceStatus::ok; // it is back: a person has to arm again
    ticks(3000);
    EXPECT_EQ(device.force_n, 0.0);
}

TEST_F(PressedSession, NoForceIsLeftByAStopOrAnException) {
    press();
    session->stop();
    EXPECT_EQ(device.force_n, 0.0);
    EXPECT_TRUE(session->start({device,
                                *haptics::find_algorithm("swept-point"),
                                haptics::Workspace({0, 0, 0}, 1.0),
                                {},
                                {},
                                {},
                                /*armed=*/false}));
    device.position_m.z = 8e-3;
    ticks(10);
    press();
    try {
        const std::unique_ptr<Session> owned = std::move(session);
        throw std::runtime_error("as a device that draws is lost");
    } catch (const std::runtime_error&) {
    }
    EXPECT_EQ(device.force_n, 0.0);
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
