// Touches a ball with a simulated haptic device, a thousand ticks a second on a virtual clock.
//
//     example_touch

#include <cstdio>
#include <memory>

#include "engine/volume/synthetic.h"
#include "haptics/device/simulated.h"
#include "haptics/field/field.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/servo/servo.h"

using namespace palpate;
namespace hp = palpate::haptics;

int main() {
    // The object that is felt: values of 500 and more of a ball of radius 20 mm.
    const Grid grid = make_grid(glm::uvec3(96), glm::dvec3(0.5), glm::dvec3(-23.75));
    hp::TouchScene scene;
    scene.grey = synthetic::sample(synthetic::sphere({0, 0, 0}, 20.0, 0.5), grid, ScalarType::f32);
    hp::TouchParameters parameters;
    parameters.iso = 500.0;
    parameters.stiffness_n_per_m = 600.0;
    hp::tune(parameters, *scene.grey); // its noise, measured once

    // The path that the hand means to take: it rests above the ball while the force fades in, then
    // presses down to 5 mm below the surface.
    const hp::HandPath path({{0.0, {{0, 0, 30}}}, {2.5, {{0, 0, 30}}}, {3.5, {{0, 0, 15}}}});
    const hp::Workspace workspace({0, 0, 20}, 1.0); // 1 mm of the hand is 1 mm of the world
    hp::SimulatedDevice device(*hp::find_device_preset("omega"), {}, path, workspace);

    // Another thread may publish a new scene or new parameters at any time: here they stay.
    Mailbox<hp::TouchScene> scenes(std::make_unique<const hp::TouchScene>(scene));
    Mailbox<hp::TouchParameters> wishes(std::make_unique<const hp::TouchParameters>(parameters));
    const std::unique_ptr<hp::Algorithm> algorithm = hp::find_algorithm("swept-point")->make();
    hp::Servo servo({device, *algorithm, scenes, wishes}, workspace, {});
    servo.arm(); // no force before a person has asked for it

    hp::ServoTick tick;
    for (int64_t ms = 0; ms < 4500; ++ms)
        tick = servo.tick(ms * 1'000'000, ms * 1'000'000);

    const glm::dvec3 proxy = tick.touched.proxy.position_mm;
    std::printf("proxy at %.3f mm from the centre, tool %.3f mm deeper, force %.3f N\n",
                glm::length(proxy), tick.touched.depth_mm, glm::length(tick.sent_world_n));
    return tick.touched.contact == hp::Contact::touching ? 0 : 1;
}
