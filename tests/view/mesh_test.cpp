// The mesh of a label, whose faces are pulled.

#include <imgui/imgui.h>

#include "apps/view/document/pulled_mesh.h"
#include "apps/view/tools/mesh_tool.h"
#include "engine/volume/content_hash.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

constexpr double kRadius_mm = 20.0;

PulledMesh ball() {
    return {simplex_ellipsoid(glm::dvec3(0.0), glm::dvec3(kRadius_mm), 4), 3};
}

TEST(PulledMesh, IsMetByRaysAndCutByPlanes) {
    const PulledMesh mesh = ball();
    // A face of 2562 on the ball is some 1.4 mm across: its flat triangles lie 0.05 mm within it.
    const auto met = mesh.met({{100.0, 3.0, -4.0}, {-1.0, 0.0, 0.0}});
    ASSERT_TRUE(met);
    EXPECT_NEAR(met->x, std::sqrt(400.0 - 25.0), 0.1);
    EXPECT_NEAR(met->y, 3.0, 1e-9);
    EXPECT_FALSE(mesh.met({{100.0, 30.0, 0.0}, {-1.0, 0.0, 0.0}}));
    EXPECT_FALSE(mesh.met({{100.0, 0.0, 0.0}, {1.0, 0.0, 0.0}})); // it lies behind
    ASSERT_TRUE(mesh.near({0.0, 21.0, 0.0}, 2.5));
    EXPECT_FALSE(mesh.near({0.0, 25.0, 0.0}, 2.5));
    double around_mm = 0.0;
    for (const auto& [from, to] : mesh.cut({0.0, 0.0, 12.0}, {0.0, 0.0, 1.0})) {
        EXPECT_NEAR(from.z, 12.0, 1e-9);
        EXPECT_NEAR(glm::length(glm::dvec2(from)), 16.0, 0.1);
        around_mm += glm::distance(from, to);
    }
    EXPECT_NEAR(around_mm, 2.0 * 3.14159265 * 16.0, 0.5); // a closed curve
}

// Held faces go where they are pulled, those far away stay, and the pull can be taken back.
TEST(PulledMesh, FacesFollowThePull) {
    PulledMesh mesh = ball();
    const std::vector<glm::dvec3> before = mesh.mesh().positions;
    mesh.hold({kRadius_mm, 0.0, 0.0}, 3);
    for (double x = 20.5; x <= 26.0; x += 0.5)
        mesh.pull({x, 0.0, 0.0});
    const auto met = mesh.met({{100.0, 0.0, 0.0}, {-1.0, 0.0, 0.0}});
    ASSERT_TRUE(met);
    EXPECT_NEAR(met->x, 26.0, 0.3);
    for (size_t v = 0; v < before.size(); ++v)
        if (before[v].x < 0.0) {
            EXPECT_EQ(mesh.mesh().positions[v], before[v]) << v;
        }
    EXPECT_EQ(euler_number(mesh.mesh()), 2);
    mesh.let_go(false);
    EXPECT_EQ(mesh.mesh().positions, before);
    mesh.hold({kRadius_mm, 0.0, 0.0}, 3);
    mesh.pull({22.0, 0.0, 0.0});
    const std::vector<glm::dvec3> pulled = mesh.mesh().positions;
    mesh.let_go(true);
    EXPECT_EQ(mesh.mesh().positions, pulled);
    mesh.pull({30.0, 0.0, 0.0}); // nothing is held
    EXPECT_EQ(mesh.mesh().positions, pulled);
}

class MeshPulling : public ViewerTest {
 protected:
    // A ball of label 1 about the crosshair, and its mesh.
    void begin() {
        open("synthetic:phantom?size=24", {900, 1000});
        for (int i = 0; i < 12; ++i)
            key("=");
        key("b");
        click(middle(Panel::axial));
        show("mesh");
        click_widget("mesh/make");
        frame({});
        ASSERT_TRUE(viewer().work().mesh_pulling().mesh());
        EXPECT_EQ(state().tool, &kPullTool);
    }
    uint64_t labels() { return content_hash(*volume(Work::kLabels)); }
    // The mesh's farthest place to the right in the axial slice.
    glm::dvec2 right_edge() {
        const glm::dvec3 right = state().slices[0].right;
        glm::dvec3 best = state().crosshair_mm;
        for (const auto& [from, to] : viewer().work().mesh_pulling().mesh()->cut(
                 state().crosshair_mm, state().slices[0].towards))
            if (glm::dot(from - best, right) > 0.0)
                best = from;
        return pixel_of(state(), grid(), Panel::axial, best).value();
    }
};

TEST_F(MeshPulling, BecomesTheLabelInOneStep) {
    begin();
    const uint64_t before = labels();
    const size_t steps = viewer().work().edited().undo_steps;
    move(right_edge());
    button(true);
    for (int i = 1; i <= 6; ++i)
        move(right_edge() + glm::dvec2(8.0, 0.0));
    button(false);
    EXPECT_EQ(labels(), before); // until it is asked for
    click_widget("mesh/apply");
    frame({});
    EXPECT_NE(labels(), before);
    EXPECT_EQ(viewer().work().edited().undo_steps, steps + 1);
    EXPECT_FALSE(viewer().work().mesh_pulling().mesh());
    key("z", {.ctrl = true});
    frame({});
    EXPECT_EQ(labels(), before);
}

// The circle of a brush is drawn where one is in the hand.
TEST_F(MeshPulling, HasNoCircleOfABrush) {
    begin();
    const auto added = [&] { // vertices by the pointer in a view: those of its frame, and a circle
        const auto vertices = [&](glm::dvec2 at) {
            move(at);
            frame({});
            return viewer().interface().lists().CmdLists[0]->VtxBuffer.Size; // behind all panels
        };
        return vertices(middle(Panel::coronal) + glm::dvec2(31.0, 17.0)) -
               vertices(glm::dvec2(places_of(state()).tools.low_px) + 5.0);
    };
    ASSERT_EQ(state().tool, &kPullTool);
    const int by_pulling = added();
    key("b");
    EXPECT_GT(added(), by_pulling);
    key("z"); // picks, without a circle
    EXPECT_EQ(added(), by_pulling);
}

// A mesh that was pulled is no step, and is asked for all the same: it goes into its label first.
TEST_F(MeshPulling, IsAskedForBeforeItIsLost) {
    begin();
    key("z", {.ctrl = true}); // the brush's step: nothing else is asked for
    frame({});
    ASSERT_EQ(viewer().work().edited().undo_steps, 0u);
    EXPECT_FALSE(viewer().work().leaving_loses_edits()); // it is as it was made
    const auto pull = [&](double by_px) {
        move(right_edge());
        button(true);
        move(right_edge() + glm::dvec2(by_px, 0.0));
    };
    pull(20.0);
    key("escape"); // taken back
    button(false);
    EXPECT_FALSE(viewer().work().leaving_loses_edits());
    pull(20.0);
    button(false);
    const auto close = [&] {
        frame({{.kind = Event::Kind::close}});
        frame({});
    };
    close();
    ASSERT_TRUE(state().leaving);
    EXPECT_FALSE(viewer().is_done());
    click_widget("leave/cancel");
    EXPECT_TRUE(viewer().work().mesh_pulling().mesh());
    close();
    click_widget("leave/save"); // which asks for a folder
    frame({});
    EXPECT_FALSE(viewer().work().mesh_pulling().mesh());
    EXPECT_EQ(viewer().work().edited().undo_steps, 1u);
    EXPECT_TRUE(state().saving_open);
    click_widget("save/cancel");
    EXPECT_FALSE(viewer().is_done());
    EXPECT_FALSE(state().leaving);
    close();
    click_widget("leave/discard");
    EXPECT_TRUE(viewer().is_done());
}

TEST_F(MeshPulling, IsPulledIn3dAndTakenBack) {
    begin();
    const Camera camera = state().camera;
    const auto mesh = [&]() -> const PulledMesh& { return *viewer().work().mesh_pulling().mesh(); };
    const std::vector<glm::dvec3> before = mesh().mesh().positions;
    const glm::dvec2 at = middle(Panel::volume), to = at + glm::dvec2(25.0, 0.0);
    const auto held = mesh().met(ray_under(state(), at));
    ASSERT_TRUE(held);
    const double beside_mm = glm::distance(mesh().near(*held, 1e9).value(), *held);
    move(at);
    button(true);
    move(to);
    EXPECT_EQ(state().own.of<Pulling>().held_mm, *held);
    EXPECT_NE(mesh().mesh().positions, before);
    // The goal lies under the pointer, as deep as what was held. The middle of the face is as far
    // beside it as it was, and the pull ends within 0.02 edges of there.
    const Ray ray = ray_under(state(), to);
    const glm::dvec3 away = glm::normalize(camera.target_mm - camera.eye_mm);
    const glm::dvec3 goal = ray.origin_mm + glm::dot(*held - ray.origin_mm, away) /
                                                glm::dot(ray.direction, away) * ray.direction;
    double edge_mm = 0.0;
    const SimplexMesh& now = mesh().mesh();
    for (size_t face = 0; face + 1 < now.face_first.size(); ++face)
        for (uint32_t i = now.face_first[face]; i + 1 < now.face_first[face + 1]; ++i)
            edge_mm = std::max(edge_mm, glm::distance(now.positions[now.face_vertices[i]],
                                                      now.positions[now.face_vertices[i + 1]]));
    EXPECT_LE(glm::distance(mesh().near(goal, 1e9).value(), goal), beside_mm + 0.02 * edge_mm);
    key("escape");
    EXPECT_EQ(viewer().work().mesh_pulling().mesh()->mesh().positions, before);
    button(false);
    // The camera stays where the mesh is pulled, and turns beside it.
    EXPECT_EQ(state().camera.eye_mm, camera.eye_mm);
    move(middle(Panel::volume) + glm::dvec2(-100.0, -100.0));
    button(true);
    move(middle(Panel::volume) + glm::dvec2(-60.0, -100.0));
    button(false);
    EXPECT_NE(state().camera.eye_mm, camera.eye_mm);
    EXPECT_EQ(viewer().work().mesh_pulling().mesh()->mesh().positions, before);
}

TEST_F(MeshPulling, OfNoSampleIsRefusedAndDropped) {
    open("synthetic:phantom?size=24", {900, 1000});
    show("mesh");
    click_widget("mesh/make");
    frame({});
    EXPECT_FALSE(viewer().work().mesh_pulling().mesh());
    begin();
    click_widget("mesh/drop");
    frame({});
    EXPECT_FALSE(viewer().work().mesh_pulling().mesh());
}

} // namespace
} // namespace palpate::view
