#pragma once

#include <memory>
#include <vector>

#include "apps/view/document/touch.h"
#include "apps/view/tools/palette.h"
#include "engine/scene/scene.h"

namespace palpate::view {

// The widgets in 3D that a hand feels, sees and presses, one or none at a time.
class HandPalette {
 public:
    // For each frame: widgets act when they are pressed far enough; a slider follows as long as it
    // is. Then the session feels those that the state shows.
    void follow(ViewState& state, Touch& touch, Session& session);

    bool is_pressed() const { return is_pressed_; }
    bool is_shown() const { return !widgets_.empty(); }
    // As they are seen, if any is.
    SurfaceLayer layer() const { return palette_layer(widgets_, touched_); }
    const std::shared_ptr<const Mesh>& mesh() const { return mesh_; }

 private:
    std::vector<Widget3d> widgets_; // that are felt and drawn
    haptics::PlateTouch touched_;   // of them, as drawn
    std::shared_ptr<const Mesh> mesh_;
    bool is_pressed_ = false;
};

} // namespace palpate::view
