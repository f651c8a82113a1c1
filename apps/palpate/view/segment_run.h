#pragma once

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "engine/segment/methods.h"

namespace palpate::view {

// What a method works on, as it was when it was asked for.
struct SegmentJob {
    const SegmentMethod* method = nullptr;
    ParameterValues given;
    Volume volume, labels;       // the map that the result is put into
    std::optional<Volume> seeds; // of labels 1 .. 254, and `outside`
    uint16_t outside = 0;
    std::vector<uint16_t> locked{}; // labels that stay as they are
};

struct SegmentDone {
    Volume labels;                  // the map with the result in it
    std::optional<Volume> strength; // Segmented::strength
    double threshold = 0.0;         // of strength, that bounds the result
    std::vector<std::string> notes;
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

 private:
    Result<SegmentDone> run();
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

// The samples that a method's strength calls the object, for a fused volume's transfer function.
bool is_object_below(const SegmentMethod& method); // else above

} // namespace palpate::view
