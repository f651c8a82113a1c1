#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "apps/view/document/dust_cloud.h"
#include "apps/view/document/hand_palette.h"
#include "apps/view/document/hand_tool.h"
#include "apps/view/document/mesh_pulling.h"
#include "apps/view/document/milling_sound_output.h"
#include "apps/view/document/touch.h"

namespace palpate::view {

// A person's hand on a document: strokes of the mouse, and a device with its tools, the widgets
// that it presses, and what is seen and heard of it.
class HandLink {
 public:
    HandLink(OpenDocument& document, MeshPulling& mesh_pulling);

    // A stroke of the mouse, by the tool of the left button. A cancelled one is undone.
    // disc_across: the direction across a disc; 0: the brush is a ball.
    void begin_stroke(StrokePose pose, const ViewState& state, glm::dvec3 disc_across = {});
    void move_stroke(StrokePose pose);
    void end_stroke(StrokePose pose);
    void cancel_stroke(double time_s);
    bool is_drawing() const { return is_drawing_; } // one is under way

    void start(const std::string& device, const Stylus& stylus); // empty: the last one
    // For each frame: gives the device's buttons their tools, moves a hand that the pointer is,
    // ticks where nothing is threaded, and notes in the state what it has become.
    void follow(ViewState& state, double time_s);

    Touch& touch() { return touch_; }
    const Touch& touch() const { return touch_; }
    bool presses_widget() const { return palette_.is_pressed(); }
    const DustCloud& dust() const { return dust_; }
    const MillingSoundOutput& sound() const { return sound_; }

    // How far the document is behind the hand: inputs that it does not have yet, and for how long
    // the oldest of them has waited, to a frame. None is dropped.
    struct Backlog {
        uint64_t inputs = 0;
        double seconds = 0.0;
    };
    const Backlog& backlog() const { return backlog_; }
    static constexpr double kFarBehind_s = 1.0; // a person is told

    // The tool at the proxy, and what the hand can pull and press, as they lie in the 3D view.
    struct Surface {
        SurfaceLayer layer;
        std::shared_ptr<const Mesh> mesh;
    };
    std::vector<Surface> surfaces(const ViewState& state);
    // The grey values to point at: while a button is pressed, those before the press.
    Volume pointed_at();

 private:
    bool take_tool(const ViewState& state);
    ToolPose posed(const ToolPose& tool) const; // as the brush lies
    void hold_tools(const ViewState& state);
    void measure_backlog(double time_s);
    uint32_t granted_buttons(const ViewState& state, double time_s);
    void move_things(ViewState& state);

    OpenDocument& document_;
    MeshPulling& mesh_pulling_;
    ToolRack rack_;
    bool is_drawing_ = false;
    StrokePose last_;                                 // of the mouse
    glm::dvec3 disc_across_{0.0};                     // of its stroke; 0: a ball
    bool labels_asked_ = false, seeds_asked_ = false; // an empty map is on its way
    Touch touch_;
    TipMesh tip_;
    HandPalette palette_;
    DustCloud dust_;
    MillingSoundOutput sound_;
    Backlog backlog_;
    std::deque<std::pair<uint64_t, double>> given_; // inputs by a frame's time, not all done
    uint32_t pressed_buttons_ = 0;                  // of the pointer's hand, in the last frame
    uint32_t granted_ = 0;                          // of those that are pressed
    std::optional<double> held_since_s_; // the others are not, from when on; infinite: it was told
    std::optional<Volume> before_press_; // the grey values, while it presses
    struct Pull {                        // of the mesh, by the hand's button
        glm::dvec3 held_mm, from_mm;
    };
    std::optional<Pull> pull_;
};

} // namespace palpate::view
