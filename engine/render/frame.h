#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/image/image.h"
#include "engine/render/changed_pixels.h"
#include "engine/scene/scene.h"

// A renderer's pictures, and the cost of drawing them.
namespace palpate {

// How many segments of the sample lattice lie inside the volume's box, over all rays of a picture:
// what a ray caster that skips and stops nowhere would sample. Clip planes and slices left out.
uint64_t count_segments(const Scene& scene, const Grid& grid);

// The whole picture, at full quality.
struct WholePicture {};

// A box of pixels alone, with those of the tiles that it touches, at full quality over the view's
// last frame: for data that changed nothing outside of the box (changed_pixels()). Meshes are
// opaque and not live; they may have moved since the last frame, while their number and styles are
// the same. All pixels where no such frame is there.
struct ChangedPixels {
    PixelBox box;
};

// Rows of tiles (kTileSide pixels high) at full quality over what is there, of a scene with rays.
// When all Renderer::tile_rows() have been drawn the picture is that of WholePicture.
struct TileRows {
    uint32_t first, count;
};

// A picture from fewer rays than it has pixels, for a hand that is moving, of a scene with rays.
struct CoarseSettings {
    // Steps this much longer than the scene's; >= 1. The exact integrator has none to lengthen.
    double step_factor = 1.0;
    // Every second pixel both ways has a ray. Between four rays that differ by more than this, the
    // other pixels have rays, too; elsewhere they take the mean of their neighbours. What counts is
    // the root of the mean square between neighbours over the colour's channels (0 .. 1), and half
    // of what no mean of two rays fits: a - b - c + d of the channel where that is largest. Left
    // out, it is 0.06, and 0.115 between iso-surfaces, which are smooth from edge to edge, so that
    // a mean errs less (docs/log/rendering.md).
    // Of iso-surfaces (but with the exact integrator, or among see-through meshes) a ray between
    // four others begins two steps before the nearest of what these meet: what is thinner than two
    // pixels and lies in front of all that may be missed. TileRows show it; error_estimate counts
    // it.
    std::optional<double> contrast{};
    // 2: as above. 4, 8 or 16: rays lie so many pixels apart both ways, and there are no others.
    uint32_t px_per_ray = 2;
};

// The pixels that a frame draws, and from how many rays. But for WholePicture, value and depth of a
// scene with rays are left out.
using Request = std::variant<WholePicture, ChangedPixels, TileRows, CoarseSettings>;

// The rays that an interactive frame is judged by lie this many pixels apart both ways: odd, for
// every other one has a ray anyhow.
inline constexpr uint32_t kJudgedSpacing_px = 19;

// The error of a picture from fewer rays, and how many there were.
struct CoarseStats {
    // RMSE of the picture's colours (1 is white), from rays of full quality through one pixel in
    // kJudgedSpacing_px squared: every such one both ways from `first_judged` on, which wanders
    // from frame to frame.
    double error_estimate = 0;
    glm::uvec2 first_judged{0};
    double traced_share = 0; // of the pixels: those with rays of their own; empty tiles have none
                             // (but are counted where px_per_ray is above 2)
};

// The cost of one frame: times in ms, and counts of uploads.
struct FrameStats {
    std::vector<PassTime> passes; // GPU time of each, in order
    double ray_ms = 0;  // of that, the rays': all but those that a picture from fewer is judged by
    double wall_ms = 0; // from recording to the GPU's last word, fenced
    size_t uploaded_bricks = 0;
    size_t made_blocks = 0;  // of live surfaces, 8^3 samples each
    double cell_map_ms = 0;  // CPU time for what is jumped over, where that had to be made
    double gradients_ms = 0; // wall time for stored gradients, where some had to be filled in
    // How the volume lies on the device, and why; of an atlas, the bricks that can be seen, those
    // it has room for, and in how many parts the volume was marched.
    bool atlas = false;
    std::string residency_reason;
    size_t needed_bricks = 0, room_for_bricks = 0, parts = 1;
    std::optional<CoarseStats> coarse{}; // where CoarseSettings were asked for
};

// The rays of a coarse frame, as the device leaves their counts. For CoarsePass.
struct CoarseRays {
    BufferSlice counts, squares; // gpu::kRayGroupWords; squared errors
    size_t judged;               // how many rays were
    glm::uvec2 first_judged;
    std::optional<uint64_t> traced; // where the device counts none
    uint64_t pixels;

    CoarseStats stats() const; // once the device is past the frame
};

// The cost of a recorded frame, once the device is past it. It must not outlive the device.
class FrameTicket {
 public:
    bool ready() const { return ticket_.ready(); } // never waits
    // After the commands were submitted: waits where not ready(). wall_ms is 0: who submits knows
    // when the work began.
    FrameStats stats() const;

 private:
    friend class Renderer;
    FrameTicket(Ticket ticket, FrameStats known, size_t first, size_t last)
        : ticket_(std::move(ticket)), known_(std::move(known)), first_(first), last_(last) {}
    Ticket ticket_;
    FrameStats known_;
    std::optional<CoarseRays> coarse_;
    std::vector<size_t> ray_passes_; // among those of the commands
    size_t first_, last_;            // its passes among those of the commands
};

// A frame that was recorded. The images stay the renderer's and hold the frame for what is recorded
// into the same commands before the renderer's next frame.
struct RecordedFrame {
    GpuImage* picture; // RGBA, display values (image.h), a layer an eye
    GpuImage* values;  // value and depth; null where the scene does not ask for them
    FrameTicket ticket;
};

// One eye's picture: R, G, B, A and, where the scene asks for them, "value" and "depth".
struct Frame {
    std::vector<Image> eyes; // one, or left and right
    FrameStats stats;
};

} // namespace palpate
