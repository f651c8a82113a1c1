#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "apps/view/document/hand_link.h"
#include "apps/view/document/open_document.h"
#include "apps/view/document/segment_run.h"
#include "apps/view/document/segment_times.h"
#include "apps/view/document/wire_tracer.h"

namespace palpate::view {

// The least box of samples that holds all that clip planes keep; none: they keep no sample.
std::optional<SegmentJob::Region> kept_samples(const Grid& grid,
                                               const std::vector<ClipPlane>& planes);

// Methods that make labels: their runs, one at a time, what they left behind, and what is seen of
// them over the slices.
class Segmentation {
 public:
    // A result waits while the hand draws.
    Segmentation(OpenDocument& document, const HandLink& hand);

    void begin(const ViewState& state); // the method that the state names
    // Bounds the objects of strength() anew, by the bound that the state previews.
    void bound(const ViewState& state);
    void stop();
    void poll(); // for each frame
    // For each frame: seeds, and the preview of a result, over the slices of the session's scene.
    void show(const ViewState& state);
    // After the document's bound has become another, as by undo.
    void follow_bound();

    // How long the method that the state names will take, in seconds.
    double expected_s(const ViewState& state) const;
    std::optional<double> share() const; // of the run, 0 .. 1; none is under way
    // The last method with a strength left this behind: a person may bound its objects anew.
    const std::optional<Strength>& strength() const { return strength_; }
    // The value that a method found from the data for a parameter in its last run; none: not yet.
    std::optional<double> found(const SegmentMethod& method, const char* parameter) const;
    WireTracer& wire() { return wire_; }

 private:
    void run(SegmentJob job);
    void take(const SegmentJob& job, SegmentDone done);
    std::string told_of(const SegmentJob& job, const SegmentDone& done);
    void keep_strength();

    OpenDocument& document_;
    const HandLink& hand_;
    WireTracer wire_;
    std::unique_ptr<SegmentRun> run_;
    std::shared_ptr<KeptRun> kept_run_; // of the last run, for the next with other seeds
    SegmentTimes times_;
    std::chrono::steady_clock::time_point began_{}; // the run
    std::optional<Volume> look_;                    // what the run has come to
    std::optional<Strength> strength_;
    std::deque<Strength> kept_; // of steps, that undo and redo may come back to; the newest last
    std::map<std::string, ParameterValues> found_; // by method
};

} // namespace palpate::view
