#pragma once

#include "haptics/device/pointer_hand.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {

constexpr double kRadius_mm = 35.0; // of synthetic:ball, whose values at 500 are solid

// A hand on the mouse, in fixed time.
class HandTest : public ViewerTest {
 protected:
    Touch& touch() { return viewer().work().hand().touch(); }
    const TouchSample& now() { return touch().now().value(); }
    void wait(double seconds) {
        for (; seconds > 0.0; seconds -= 0.1)
            frame({}, 0.1);
    }
    void wheel(double notches) {
        frame({{.kind = Event::Kind::wheel, .wheel = {0.0, notches}}}, 0.05);
    }
    void start_mouse() {
        move(middle(Panel::volume));
        key("o");
        move(middle(Panel::volume));
        wait(2.0); // it comes from before the volume
    }
    glm::dvec3 towards_eye() {
        return glm::normalize(state().camera.eye_mm - state().camera.target_mm);
    }
};

} // namespace palpate::view
