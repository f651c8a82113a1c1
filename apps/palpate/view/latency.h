#pragma once

#include <functional>

#include "apps/palpate/view/viewer.h"
#include "engine/base/json.h"

namespace palpate::view {

// How fast a window answers: does by the clock what a person would, with a viewer that is threaded,
// and measures. Looks from other sides and waits for the full picture; turns the volume; moves the
// crosshair; draws and cuts in the axial view. All but the last two need the layout of four.
//
// An input happens at a random moment since the frame before began, as if it had waited for this
// one; latencies count from there to when the first picture that shows it was made. `show` draws
// and shows the frame; frames are kFrame_s apart, or as long as they take.
//
// JSON: `interface_ms` of frames while the full picture is made, and per task; `pictures_per_s` of
// the volume and of the axial slice; `error_db` of the volume's pictures against the full one
// (-20 log10 of RMSE; white is 1); `slices_ms` and `volume_ms` from input to picture.
Result<Json> measure_latency(Viewer& viewer, const std::function<void()>& show);

} // namespace palpate::view
