#pragma once

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "engine/edit/spared.h"
#include "engine/segment/arrival_threshold.h"
#include "engine/segment/methods.h"

namespace palpate::view {

// A method with a strength leaves this behind: its objects can be bounded anew.
struct Strength {
    const SegmentMethod* method = nullptr;
    Volume volume, owner;     // Segmented::strength and owner
    std::vector<uint16_t> of; // the labels that it bounds; elsewhere volume has no data
    double bound = 0.0;       // of volume, that bounds the objects
    // The ends of the bound's slider, which moves over the logarithm of times. Times far from the
    // bound are of no use; where none was found, the ends are the first and the last time of the
    // front. Equal: no slider.
    double least = 0.0, most = 1.0;
    std::string id;            // a hash of volume
    bool is_unbounded = false; // the labels do not have these objects yet
};

struct SegmentDone {
    Volume labels; // the map with the result in it, but for objects without a bound
    std::optional<Strength> strength;
    ParameterValues found; // Segmented
    std::vector<std::string> notes;
    Volume objects;           // that go into the map
    std::vector<uint16_t> of; // the labels that they take the place of
    uint16_t met_locked = 0;  // Spared::met
    bool met_mask = false;    // likewise
};

// The input of a method, as it was when the method was asked for.
struct SegmentJob {
    const SegmentMethod* method = nullptr;
    ParameterValues given;
    Volume volume, labels;       // the map that the result is put into
    std::optional<Volume> seeds; // of labels, and `outside`
    uint16_t outside = 0;
    EditLimits limits{}; // of changes of the map
    uint16_t label = 0;  // in the hand: of several, the one that is bounded again
    // The method is not run: its objects are bounded by this.
    std::optional<Strength> again{};
    // Samples low .. high that the method works on, both included; none: on all. What lies outside
    // is of no label, and has no strength.
    struct Region {
        glm::ivec3 low, high;
    };
    std::optional<Region> region{};
    // Nor is anything bounded: what was made of the map `before` goes into `labels`, which a person
    // has changed meanwhile, but for the samples that were changed.
    std::shared_ptr<const SegmentDone> ready{};
    std::optional<Volume> before{};
    std::shared_ptr<KeptRun> kept{}; // of the run before: SegmentInput::kept
};

// A method at work on a thread of its own.
class SegmentRun {
 public:
    // threaded: false: it has been done when the constructor returns.
    SegmentRun(SegmentJob job, bool threaded);
    ~SegmentRun(); // stops it, and waits

    const SegmentJob& job() const { return job_; }
    double share() const { return share_; } // 0 .. 1
    void stop() { stop_.request_stop(); }
    // The newest labels on the way to the result, once each (Task::look); a run without a thread
    // has none. Making them takes at most a fifth of the time, and kLookEvery lies between them.
    static constexpr std::chrono::milliseconds kLookEvery{200};
    std::optional<Volume> take_look();
    // Once, when it is done.
    std::optional<Result<SegmentDone>> take();
    // After that: for the job of the next run.
    std::shared_ptr<KeptRun> kept() const { return job_.kept; }

 private:
    Result<SegmentDone> run();
    Result<Segmented> run_method(SegmentInput input, const Task& task);
    Result<SegmentDone> bound_again(const Task& task);
    void spare_locked(SegmentDone& done) const;
    void set_bound(Strength& strength, const SegmentDone& found, const ArrivalGrowth& growth);
    void look(const std::function<Volume()>& make); // from the thread

    SegmentJob job_;
    std::stop_source stop_;
    std::atomic<double> share_{0.0};
    bool threaded_;
    std::chrono::steady_clock::time_point next_look_{}; // the thread's
    std::mutex mutex_;                                  // of look_
    std::optional<Volume> look_;
    std::future<Result<SegmentDone>> result_;
};

} // namespace palpate::view
