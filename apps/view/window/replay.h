#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "apps/view/script/script.h"
#include "apps/view/window/viewer.h"

namespace palpate::view {

// Writes what happens as it happens, so that it is there after a crash. Moves are written as places
// (place.h).
class Recorder {
 public:
    // An empty path: nothing is written.
    Recorder(const std::filesystem::path& path, glm::uvec2 size_px, double text_scale);

    // Events that the viewer is about to take, in the frame of this number.
    void add(uint64_t frame, const std::vector<Event>& events, const Viewer& viewer);
    bool failed() const { return file_.fail(); }

 private:
    std::ofstream file_;
    Placing placing_;
};

// Does a script's frames, and two after its last event, at the times it tells. Of frames without
// events, in which nothing changes, at most three are done between two events. A move to a widget
// or view that is not shown leaves the pointer where it is; a press or a wheel there is an error,
// that names the frame and the place.
Result<void> replay(Viewer& viewer, const Script& script, Recorder* recorder = nullptr);

} // namespace palpate::view
