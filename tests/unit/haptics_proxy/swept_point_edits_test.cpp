// The repaired point proxy where what it touches changes, or differs from place to place.

#include <string_view>
#include <vector>

#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "haptics/proxy/swept_point.h"
#include "tests/unit/haptics_proxy/run.h"

namespace palpate::touch {
namespace {

using glm::dvec3;
using haptics::Contact;

// ---- edits --------------------------------------------------------------------------------------

// Adds or removes a ball of material whose edge is blurred by 0.7 samples, at the hand's place.
void edit_ball(haptics::TouchScene& touch, dvec3 middle_mm, double radius_mm, bool adds) {
    const Grid& grid = touch.grey->grid();
    VolumeEdit edit(*touch.grey);
    const glm::ivec3 at(glm::round(index_point(grid, middle_mm)));
    for (int i = 0; i < 729; ++i) {
        const glm::uvec3 sample(at + glm::ivec3(i % 9 - 4, i / 9 % 9 - 4, i / 81 - 4));
        const double off = glm::distance(world_point(grid, dvec3(sample)), middle_mm) - radius_mm;
        const double in_ball = 500.0 * std::erfc(off / (0.35 * std::sqrt(2.0)));
        const double before = touch.grey->value(sample);
        edit.set(sample, adds ? std::max(before, in_ball) : std::min(before, 1000.0 - in_ball));
    }
    touch.grey = edit.commit();
    touch.version = touch.grey->version();
}

// Removal, growth, undo and flicker under contact: the force changes by at most 0.10 N beyond what
// the hand moves.
TEST(SweptPoint, EditsUnderContactDoNotKick) {
    const Scene scene = make_scene(flat_plane(), {});
    const Volume before = *scene.touch.grey;
    VolumeEdit removal(before), growth(before);
    const Grid grid = before.grid();
    for (uint32_t z = 0; z < grid.size.z; ++z)
        for (uint32_t y = 20; y < 45; ++y)
            for (uint32_t x = 20; x < 45; ++x) {
                const dvec3 p = world_point(grid, {x, y, z});
                if (p.z > -2.0)
                    removal.set({x, y, z}, 0.0); // 2 mm of it are gone
                if (p.z < 1.5)
                    growth.set({x, y, z}, 1000.0); // 1.4 mm more
            }
    const Volume less = removal.commit(), more = growth.commit();
    for (const int kind : {0, 1, 2, 3}) {
        haptics::TouchScene touch = scene.touch;
        haptics::TouchParameters parameters = settings(scene);
        const auto algorithm = haptics::make_swept_point();
        haptics::TickInput input{.scene = &touch, .parameters = &parameters};
        dvec3 last_force(0.0), last_tool(0, 0, 2.0);
        double worst = 0.0, least = INFINITY, most = 0.0;
        for (int i = 0; i < 1200; ++i) {
            const dvec3 x(0.0005 * i, 0.1, std::max(-1.0, 2.0 - 0.02 * i));
            if (i == 300)
                touch.grey = kind == 0 ? less : more;
            if (i == 600 && kind >= 1)
                touch.grey = kind == 1 ? before : less;
            if (kind == 3 && i > 300 && i % 5 == 0) // 200 Hz
                touch.grey = i % 10 == 0 ? less : before;
            input.velocity_mm_per_s = (x - last_tool) * 1000.0;
            input.tool.position_mm = x;
            const haptics::TickOutput out = algorithm->tick(input);
            ASSERT_TRUE(std::isfinite(out.force_n.z));
            if (i > 0)
                worst = std::max(worst, glm::distance(out.force_n, last_force) -
                                            glm::distance(x, last_tool)); // k = 1 N/mm
            if (i > 500 && i < 600) {
                least = std::min(least, out.force_n.z);
                most = std::max(most, out.force_n.z);
            }
            last_force = out.force_n;
            last_tool = x;
        }
        EXPECT_LE(worst, 0.10) << kind;
        if (kind == 0) {
            EXPECT_LE(most, 1e-9) << "what is removed is no longer felt";
        }
        if (kind == 1) {
            EXPECT_NEAR(least, 2.3, 0.4) << "what was added is";
        }
    }
}

// Nothing but the snapshot changes: straight above its contact a proxy need not move at all, and
// what is touched must be looked for again.
TEST(SweptPoint, ForceEndsWithWhatIsTouchedUnderAHandAtRest) {
    const Scene scene = make_scene(flat_plane(), {});
    VolumeEdit removal(*scene.touch.grey);
    const Grid grid = scene.touch.grey->grid();
    for (uint32_t z = 0; z < grid.size.z; ++z)
        for (uint32_t y = 0; y < grid.size.y; ++y)
            for (uint32_t x = 0; x < grid.size.x; ++x)
                if (world_point(grid, {x, y, z}).z > -4.0)
                    removal.set({x, y, z}, 0.0);
    haptics::TouchScene touch = scene.touch;
    haptics::TouchParameters parameters = settings(scene);
    const auto algorithm = haptics::make_swept_point();
    haptics::TickInput input{.scene = &touch, .parameters = &parameters};
    haptics::TickOutput out;
    for (int i = 0; i < 300; ++i) {
        input.tool.position_mm = {0, 0, std::max(-1.0, 2.0 - 0.02 * i)};
        out = algorithm->tick(input);
    }
    EXPECT_NEAR(out.force_n.z, 1.0 + scene.body.touch_mm.z, 0.01); // k = 1 N/mm
    touch.grey = removal.commit();
    for (int i = 0; i < 50; ++i) // bled off within 1 N at 90 N/s
        out = algorithm->tick(input);
    EXPECT_EQ(out.force_n, dvec3(0.0));
    EXPECT_EQ(out.contact, haptics::Contact::free);
}

// Edits takes over 5 s of a processor: edits come under a hand that is felt tick by tick, once with
// them and once without.

// Somebody else edits far away, in every tick: what is felt here, friction too, is as without.
TEST(Edits, ElsewhereLeaveWhatIsFelt) {
    const Scene scene = make_scene(flat_plane(), {});
    for (const char* name : {"swept-point", "swept-tool", "swept-local"}) {
        haptics::TouchParameters parameters = settings(scene);
        parameters.friction_static = parameters.friction_dynamic = 0.3;
        const double radius_mm = name == std::string_view("swept-tool") ? 1.5 : 0.0;
        parameters.tool_radius_mm = radius_mm;
        std::vector<dvec3> forces[2];
        for (const bool edited : {false, true}) {
            haptics::TouchScene touch = scene.touch;
            const auto algorithm = haptics::find_algorithm(name)->make();
            haptics::TickInput input{.scene = &touch, .parameters = &parameters};
            for (int i = 0; i < 600; ++i) {
                if (edited && i > 0)
                    edit_elsewhere(touch, i);
                input.tool.position_mm = {0.01 * std::max(0, i - 200), 0.1,
                                          radius_mm + std::max(-1.0, 2.0 - 0.02 * i)};
                forces[edited].push_back(algorithm->tick(input).force_n);
            }
        }
        for (size_t i = 0; i < forces[0].size(); ++i)
            // A proxy that sets out anew converges to 1e-4 mm, at 1 N/mm, in a few steps.
            ASSERT_LE(glm::distance(forces[0][i], forces[1][i]), 1e-3) << name << ", tick " << i;
        EXPECT_NEAR(-forces[0].back().x / forces[0].back().z, 0.3, 0.005) << name;
    }
}

// A ball of material that comes or goes under, over and beside what touches, at once or growing.
// Force changes by no more than 90 N/s, also in the ticks after an edit, in which geometry may
// still come to rest: until these counted as the edit's, by 0.87 N for a point and 0.66 for a local
// surface.
TEST(Edits, BesideWhatTouchesAreFeltGentlyUntilAllRests) {
    for (const char* name : {"swept-point", "swept-tool", "swept-local"}) {
        const double radius = name == std::string_view("swept-tool") ? 1.0 : 0.0;
        double worst_n = 0.0;
        for (int kind = 0; kind < 4; ++kind)
            for (const double beside : {0.0, 0.75, 1.5, 2.25})
                for (const double above : {-2.0, -1.0, 0.0, 0.5, 1.0, 1.5}) {
                    Scene scene = make_scene(flat_plane(), {});
                    const haptics::TouchParameters parameters = [&] {
                        haptics::TouchParameters p = settings(scene);
                        p.tool_radius_mm = radius;
                        return p;
                    }();
                    haptics::TickInput input{.scene = &scene.touch, .parameters = &parameters};
                    dvec3 x(0.1, 0.2, 0.13 + radius + 1.0), last_n(0.0);
                    input.tool.position_mm = x;
                    const auto algorithm = haptics::find_algorithm(name)->make();
                    algorithm->reset(input);
                    const dvec3 middle(0.1 + radius + beside, 0.2, 0.13 + radius - 0.5 + above);
                    for (int i = 0; i < 300; ++i) {
                        x.z -= i < 150 ? 0.01 : 0.0;
                        const bool adds = kind < 2, grows = kind % 2 == 1;
                        if (i == 170 || (grows && i > 170 && i < 210 && i % 8 == 2))
                            edit_ball(scene.touch, middle, grows ? 0.3 + 0.03 * (i - 170) : 1.0,
                                      adds);
                        input.tool.position_mm = x;
                        const dvec3 force_n = algorithm->tick(input).force_n;
                        if (i > 150)
                            worst_n = std::max(worst_n, glm::distance(force_n, last_n));
                        last_n = force_n;
                    }
                }
        EXPECT_LE(worst_n, 0.09 + 1e-6) << name;
        EXPECT_GT(worst_n, 0.05) << name; // edits were felt
    }
}

// An iso-value moved while touching slides the surface, too.
TEST(SweptPoint, IsoValueMovedUnderContactDoesNotKick) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = settings(scene);
    const auto algorithm = haptics::make_swept_point();
    haptics::TickInput input{.scene = &scene.touch, .parameters = &parameters};
    double worst = 0.0;
    dvec3 last(0.0);
    for (int i = 0; i < 400; ++i) {
        input.tool.position_mm = {0, 0, i < 100 ? 2.0 - 0.03 * i : -1.0};
        if (i == 200)
            parameters.iso = 200.0;
        if (i == 300)
            parameters.iso = 800.0;
        const dvec3 force = algorithm->tick(input).force_n;
        if (i > 100)
            worst = std::max(worst, glm::distance(force, last));
        last = force;
    }
    EXPECT_LE(worst, 0.10);
    EXPECT_GT(worst, 0.01); // it did move
}

// ---- labels -------------------------------------------------------------------------------------

// Two labels side by side, the same surface: what they feel like changes smoothly across the
// border.
TEST(SweptPoint, LabelsDifferAndMeetSmoothly) {
    Scene scene = make_scene(flat_plane(), {.form = Form::labels});
    const Grid grid = scene.touch.labels->grid();
    const Volume one = *scene.touch.labels;
    scene.touch.labels = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        return one.value(i) == 0.0f ? 0.0 : world_point(grid, dvec3(i)).x < 0.0 ? 1.0 : 2.0;
    });
    haptics::TouchParameters parameters = scene_parameters(scene);
    parameters.source = haptics::TouchSource::labels;
    parameters.label_count = 2;
    parameters.labels[0] = {.label = 1, .stiffness_n_per_m = 500.0};
    parameters.labels[1] = {.label = 2, .stiffness_n_per_m = 1500.0};
    Path path;
    for (int i = 0; i < 200; ++i)
        path.push_back({-4.0, 0.2, 2.0 - 0.02 * i});
    for (int i = 0; i < 800; ++i)
        path.push_back({-4.0 + 0.01 * i, 0.2, -2.0});
    const Trace run = run_named("swept-point", scene, path, parameters);
    const double depth = run.ticks[250].proxy.z + 2.0;
    EXPECT_NEAR(depth, 2.0, 0.5);
    EXPECT_NEAR(run.ticks[250].force.z, 0.5 * depth, 0.02 * depth);
    EXPECT_NEAR(run.ticks[999].force.z, 1.5 * (run.ticks[999].proxy.z + 2.0), 0.05 * depth);
    double worst = 0.0;
    for (size_t i = 220; i < run.ticks.size(); ++i)
        worst = std::max(worst, glm::distance(run.ticks[i].force, run.ticks[i - 1].force));
    // 1 N/mm over a border of about 3 samples (1.5 mm), 2 mm deep: 0.013 N for 0.01 mm, and the
    // steepest part of the spline is twice its mean.
    EXPECT_LE(worst, 0.04);
}

// An undo over a point that touches nothing: out again from as deep as samples tell of no slope, by
// the nearest way; the nearer the free side, the better that is.
TEST(SweptPoint, MatterThatReturnsPushesOutAPointThatTouchedNothing) {
    for (const dvec3 spacing : {dvec3(0.5), kUneven_mm})
        for (const dvec3 normal : {dvec3(0, 0, 1), glm::normalize(dvec3(1, 1, 1))}) {
            const Storage storage{.spacing_mm = spacing};
            const dvec3 surface(0.11, -0.17, 0.13);
            TouchCase body = flat_plane();
            body.solid = plane(surface, normal);
            const Scene scene = make_scene(body, storage);
            const Scene empty =
                make_scene(TouchCase{.id = "", .name = "", .solid = nothing()}, storage);
            const haptics::TouchParameters parameters = settings(scene);
            for (int step = 1; step <= 7; ++step) {
                const double depth_mm = 0.5 * step * spacing.z;
                const auto algorithm = haptics::make_swept_point();
                haptics::TouchScene touch = empty.touch;
                haptics::TickInput input{.scene = &touch, .parameters = &parameters};
                input.tool.position_mm = surface - depth_mm * normal;
                algorithm->reset(input);
                for (int i = 0; i < 5; ++i)
                    EXPECT_EQ(algorithm->tick(input).contact, Contact::free);
                touch.grey = scene.touch.grey;
                ++touch.version;
                haptics::TickOutput out;
                for (int i = 0; i < 200; ++i)
                    out = algorithm->tick(input);
                EXPECT_EQ(out.contact, Contact::touching) << depth_mm;
                // At 1 N/mm: 0.05 voxels deep and 1.5 degrees off, as everywhere.
                EXPECT_NEAR(glm::dot(out.force_n, normal), depth_mm, 0.05 * voxel_mm(storage));
                EXPECT_LE(glm::length(glm::cross(out.force_n, normal)),
                          std::sin(glm::radians(1.5)) * depth_mm);
            }
        }
}

// A start inside material: out where a surface is near, nothing felt where none is.
TEST(SweptPoint, StartInsideMaterialIsPushedOutOrFeelsNothing) {
    const Scene scene = make_scene(flat_plane(), {});
    const haptics::TouchParameters parameters = settings(scene);
    for (const double depth : {0.5, 6.0}) {
        const auto algorithm = haptics::make_swept_point();
        haptics::TickInput input{.scene = &scene.touch, .parameters = &parameters};
        input.tool.position_mm = {0, 0, 0.13 - depth};
        haptics::TickOutput out;
        for (int i = 0; i < 50; ++i)
            out = algorithm->tick(input);
        if (depth < 1.0) {
            EXPECT_EQ(out.contact, Contact::touching);
            EXPECT_NEAR(out.force_n.z, depth, 0.02);
        } else {
            EXPECT_EQ(out.contact, Contact::submerged);
            EXPECT_EQ(out.force_n, dvec3(0.0));
        }
    }
}

} // namespace
} // namespace palpate::touch
