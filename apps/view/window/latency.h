#pragma once

#include <functional>
#include <optional>

#include "apps/view/window/viewer.h"
#include "engine/base/json.h"

namespace palpate::view {

// How fast a window answers: does by the clock what a person would, with a viewer that is threaded,
// and measures. Looks from other sides and waits for the full picture; turns the volume as seen
// from three of them; moves the crosshair; draws and cuts in each slice. All but the first two need
// the layout of four.
//
// Inputs come at random moments, 8 to 25 ms apart, and turns are taken as by the window's loop
// (Pacing). Latencies count from the moment of an input to when the first picture that shows it was
// made. `show` draws and shows the frame, and returns when that is done.
//
// JSON: `interface_ms` of frames that are drawn while the full picture is made, and per task, from
// their turn to when they were drawn; `pictures_per_s` of the volume and of the axial slice;
// `error_db` of the volume's pictures against the full one (-20 log10 of RMSE; white is 1), whose
// p95 and most are the lowest; `slices_ms` and `volume_ms` from input to picture.
Result<Json> measure_latency(Viewer& viewer, const std::function<std::optional<Ticket>()>& show);

} // namespace palpate::view
