#include "bench/touch/special_cases.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bench/touch/laws.h"
#include "bench/touch/open_loop.h"
#include "engine/volume/synthetic.h"
#include "haptics/field/field.h"

namespace palpate::touch {
namespace {

using glm::dvec3;

const Storage kFloats{}, kWhole{.spacing_mm = kUneven_mm, .form = Form::grey_i16},
    kLabels{.form = Form::labels};

haptics::TouchParameters settings(const Scene& scene) {
    haptics::TouchParameters parameters = scene_parameters(scene);
    if (scene.storage.form == Form::labels)
        parameters.source = haptics::TouchSource::labels;
    else if (scene.touch.grey)
        haptics::tune(parameters, *scene.touch.grey);
    if (scene.body.transfer)
        parameters.transfer[0] = *scene.body.transfer;
    return parameters;
}

Figures touched(const char* name, const Scene& scene, const Trajectory& trajectory) {
    return open_loop(*haptics::find_algorithm(name)->make(), scene, trajectory, settings(scene));
}

const TouchCase& named(const std::vector<TouchCase>& cases, std::string_view name) {
    for (const TouchCase& one : cases)
        if (one.name == name)
            return one;
    ADD_FAILURE() << name;
    return cases.front();
}

// A ball at the place where its middle rests touches and does not enter; and no place of a search
// about the middle's goal is both nearer and free of the ball.
TEST(GrownSolid, HoldsABallWhereItTouches) {
    std::mt19937_64 random(5);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0; };
    constexpr double kRadius_mm = 0.75; // the least rounding of a hollow edge there
    for (const TouchCase& body : touch_cases({}, true)) {
        if (!body.solid.nearest_free || body.id == "A10")
            continue;
        const Solid solid = grown(body.solid, kRadius_mm);
        int checked = 0;
        for (int i = 0; i < 3000 && checked < 20; ++i) {
            const dvec3 x = body.touch_mm + 3.0 * dvec3(unit(), unit(), unit());
            if (solid.distance_mm(x) >= 0.0 || -body.solid.distance_mm(x) > body.deepest_mm)
                continue;
            const auto rest = solid.nearest_free(x);
            if (!rest)
                continue;
            ++checked;
            EXPECT_NEAR(body.solid.distance_mm(*rest), kRadius_mm, 1e-6) << body.name;
            const double reach = glm::distance(x, *rest);
            for (int k = 0; k < 1000; ++k) {
                const dvec3 way = glm::normalize(dvec3(unit(), unit(), unit()) + 1e-9);
                ASSERT_LT(solid.distance_mm(x + 0.999 * reach * way), 1e-3 * reach + 1e-6)
                    << body.name;
            }
        }
        EXPECT_GE(checked, 5) << body.name;
    }
}

// Each stage of an edit holds what a volume made for its body alone would, shares the bricks that
// did not change, and an undo is the first snapshot itself.
TEST(SpecialCases, EveryEditLeavesItsBody) {
    for (const Storage& storage : {kFloats, kLabels})
        for (const TouchCase& body : cases_of_edits()) {
            const Scene scene = make_scene(body, storage);
            const bool labels = storage.form == Form::labels;
            const auto felt = [&](const haptics::TouchScene& touch) {
                return labels ? *touch.labels : *touch.grey;
            };
            ASSERT_EQ(scene.stages.size(), body.edits.size());
            for (size_t i = 0; i < scene.stages.size(); ++i) {
                const Volume stage = felt(scene.stages[i].touch), first = felt(scene.touch);
                EXPECT_EQ(stage.is_same_as(first), i == 0 || body.edits[i].is_undo) << body.name;
                if (i != 1 && i + 2 != scene.stages.size())
                    continue; // others are made the same way
                TouchCase alone = body;
                alone.edits.clear();
                alone.solid = body.edits[i].solid;
                const Volume whole = felt(make_scene(alone, storage).touch);
                for (uint32_t z = 0; z < whole.size().z; z += 3)
                    for (uint32_t y = 0; y < whole.size().y; y += 2)
                        for (uint32_t x = 0; x < whole.size().x; ++x)
                            ASSERT_NEAR(stage.value({x, y, z}), whole.value({x, y, z}), 2e-3)
                                << body.name << " " << i;
                // The corner that the plane looks at is free, before and after.
                const glm::uvec3 free_corner = stage.brick_count() - 1u;
                EXPECT_EQ(stage.brick_ptr(free_corner), first.brick_ptr(free_corner)) << body.name;
            }
        }
}

TEST(SpecialCases, StagesFollowOneAnotherOverAndOver) {
    const Scene scene = make_scene(named(cases_of_edits(), "flicker"), kFloats);
    std::vector<size_t> stages;
    for (size_t tick = 0; tick < 12; ++tick)
        stages.push_back(scene.stage_at(tick));
    EXPECT_EQ(stages, (std::vector<size_t>{0, 0, 1, 1, 1, 0, 0, 1, 1, 1, 0, 0}));
    EXPECT_EQ(make_scene(touch_cases({}, false).front(), kFloats).stage_at(1000), 0u);
}

// A12: nothing is felt where there is no surface, and values at the end of their type are a plane
// like any other.
TEST(SpecialCases, WhereNoSurfaceIsNoForceIs) {
    size_t asked = 0;
    for (const Storage& storage : {kFloats, kWhole, kLabels})
        for (const TouchCase& body : cases_of_no_surface(storage)) {
            if (!body.why_not.empty())
                continue;
            const Scene scene = make_scene(body, storage);
            for (const Trajectory& trajectory : {Trajectory{.path = press(body, 60.0, 3.0, 0.02)},
                                                 Trajectory{.path = hand(body, 2.0, 0.5, 3)},
                                                 Trajectory{.path = walk(body, 20.0, 300, 4),
                                                 .judge_jumps = false,
                                                 .judge_direction = false}})
                for (const char* name : {"swept-point", "swept-tool", "swept-local"}) {
                    ++asked;
                    const Figures f = touched(name, scene, trajectory);
                    EXPECT_EQ(f.not_finite, 0u) << name << " " << body.name;
                    EXPECT_LE(f.free_force_n, 1e-9) << name << " " << body.name;
                    if (body.name == "extremes/plane" && storage.form != Form::labels &&
                        name == std::string_view("swept-point") && trajectory.judge_jumps) {
                        EXPECT_LE(f.penetration_voxels, 0.05);
                        EXPECT_LE(f.direction_deg.percentile(0.99), 1.5);
                        EXPECT_LE(f.excess_jump_n, 0.02);
                        EXPECT_GT(f.largest_force_n, 0.5); // and is felt
                    }
                }
        }
    EXPECT_GT(asked, 100u);
}

// A13: what a snapshot moves under a slow and a fast hand is bled off, and what is left when it
// has been is the new body.
TEST(SpecialCases, EditsUnderTheHandDoNotKick) {
    for (const TouchCase& body : cases_of_edits()) {
        const Scene scene = make_scene(body, kFloats);
        for (const Trajectory& trajectory : {Trajectory{.path = press(body, 20.0, 2.0, 0.6)},
                                             Trajectory{.path = press(body, 200.0, 2.0, 0.6)},
                                             Trajectory{.path = slide(body, 2.0, 3.0, 0.7)}})
            for (const char* name : {"swept-point", "swept-tool"}) {
                const Figures f = touched(name, scene, trajectory);
                EXPECT_EQ(f.not_finite, 0u) << name << " " << body.name;
                EXPECT_LE(f.free_force_n, 1e-9) << name << " " << body.name;
                // 90 N/s are bled off: 0.09 N a tick; and what a force may jump without an edit.
                EXPECT_LE(f.edit_jump_n, 0.10) << name << " " << body.name;
                if (name == std::string_view("swept-point")) {
                    EXPECT_LE(f.excess_jump_n, 0.10) << body.name;
                    EXPECT_LE(f.penetration_voxels, 0.05) << body.name;
                    EXPECT_LE(f.direction_deg.percentile(0.99), 1.5) << body.name;
                }
            }
    }
    // The printed milling proxy has no such care: it must be seen to jump.
    const TouchCase undo = named(cases_of_edits(), "undo");
    EXPECT_GT(
        touched("eriksson-2006", make_scene(undo, kFloats), {.path = press(undo, 20.0, 2.0, 0.6)})
            .edit_jump_n,
        0.5);
}

// A14: the force is the closed form's, to the rounding of the stored field (floats: 2^-24 of some
// 10^4 on directions of at least 2000, of 3 N; the transfer function rises by 3 N in 400 units).
TEST(SpecialCases, ForcesAlongFieldsAreTheirClosedForm) {
    for (const TouchCase& body : cases_of_fields(kFloats)) {
        const Scene scene = make_scene(body, kFloats);
        for (const std::string& name : body.felt_by) {
            const Figures f = touched(name.c_str(), scene, {.path = hand(body, 2.0, 1.0, 7)});
            EXPECT_LE(f.closed_form_n, 1e-4) << name << " " << body.name;
            EXPECT_GT(f.largest_force_n, 2.9) << name << " " << body.name;
        }
        // The other sign of a rule is not that form.
        const Figures wrong =
            touched("wish-2008-surface", scene, {.path = hand(body, 2.0, 1.0, 7)});
        EXPECT_GT(wrong.closed_form_n, 0.5) << body.name;
    }
}

// An answer made up: held against the next body only once an edit has settled.
TEST(Judge, WaitsForAnEditToSettle) {
    const Scene scene{.body = named(cases_of_edits(), "erosion")};
    Judge judge(scene, 1000.0, true);
    const Solid lower = plane(-1.0 * scene.body.normal, scene.body.normal);
    const auto see = [&](double force_n) {
        haptics::TickOutput output;
        output.proxy.position_mm = 0.0 * scene.body.normal;
        output.force_n = force_n * scene.body.normal;
        judge.see(-2.0 * scene.body.normal, output);
    };
    see(2.0);
    judge.exchange(lower);
    see(1.7);
    EXPECT_NEAR(judge.figures().edit_jump_n, 0.3, 1e-12);
    see(1.3);
    EXPECT_NEAR(judge.figures().edit_jump_n, 0.3, 1e-12); // not in the tick of the edit
    EXPECT_NEAR(judge.figures().excess_jump_n, 0.4, 1e-12);
    const uint64_t judged = judge.figures().direction_deg.count();
    EXPECT_EQ(judged, 1u); // before it
    for (int i = 0; i < 98; ++i)
        see(1.0);
    EXPECT_EQ(judge.figures().direction_deg.count(), judged);
    see(1.0);
    see(1.0);
    EXPECT_EQ(judge.figures().direction_deg.count(), judged + 2);
}

// A11: a place is on the surface of the samples, the tool starts free of it, and what holds the
// proxy is never felt stronger than its spring.
TEST(SpecialCases, APatientIsTouchedWhereItsSamplesSay) {
    const Grid grid = make_grid({96, 96, 60}, {1.0, 1.0, 1.6}, {-40.0, 10.0, 5.0});
    const dvec3 middle = center_mm(grid);
    const Volume volume =
        synthetic::sample(synthetic::sphere(middle, 30.0, 1.5), grid, ScalarType::f32);
    const double iso = 0.5 * (double{volume.range().min} + double{volume.range().max});
    const std::vector<Place> places = places_on(volume, iso, 4);
    ASSERT_EQ(places.size(), 4u);
    for (const Place& place : places) {
        EXPECT_NEAR(glm::distance(place.mm, middle), 30.0, 0.4); // steps of 0.25 mm, and samples
        const Scene scene = patient_scene("ball", volume, false, iso, place.mm, place.outside);
        EXPECT_NEAR(scene.body.solid.distance_mm({}), 0.0, 0.4);
        EXPECT_GT(scene.body.solid.distance_mm(2.0 * place.outside), 1.0);
        EXPECT_LT(scene.body.solid.distance_mm(-2.0 * place.outside), -1.0);
        const Figures f =
            touched("swept-point", scene, {.path = press(scene.body, 40.0, 2.0, 0.1)});
        EXPECT_EQ(f.not_finite, 0u);
        EXPECT_GT(f.largest_force_n, 1.0);
        EXPECT_LE(f.beyond_spring_n, 1e-9);
        EXPECT_LE(f.penetration_voxels, 0.1); // first order of another interpolation's surface
    }
}

// The laws of one plane, of the algorithm that is meant to keep them and of one that does not.
TEST(Laws, HoldForTheRepairedPointAndNotForThePrint) {
    const Laws laws = laws_of(*haptics::find_algorithm("swept-point"));
    EXPECT_NEAR(laws.energy_beyond_mj, 0.0, 0.02);
    EXPECT_NEAR(laws.friction_share, kLawFriction, 0.01 * kLawFriction);
    EXPECT_LE(laws.stick_drift_um_s, 1.0);
    EXPECT_NEAR(laws.yield_share, 1.0, 0.03);
    EXPECT_NEAR(laws.below_yield_share, 1.0, 0.03);
    EXPECT_LE(laws.limit_cycle_um, 50.0);
    // Paper 5 knows no threshold: it holds 4 N where 2 are asked for.
    EXPECT_NEAR(laws_of(*haptics::find_algorithm("eriksson-2006")).yield_share, 2.0, 0.05);
}

} // namespace
} // namespace palpate::touch
