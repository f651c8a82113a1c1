#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/json.h"

// Records spans of time on CPU threads and on tracks of the graphics device, and writes a trace for
// ui.perfetto.dev and chrome://tracing.
//
//     profile::start();
//     { const profile::Scope scope("load"); ... }
//     profile::save("trace.json");
//
// Until start() a Scope costs one relaxed load of a flag and records nothing. Recording may go on
// from any number of threads. Times are nanoseconds of std::chrono::steady_clock, which is
// CLOCK_MONOTONIC.
namespace palpate::profile {

namespace detail {
extern std::atomic<bool> recording;
}

inline bool on() {
    return detail::recording.load(std::memory_order_relaxed);
}

int64_t now_ns();

// Begins a recording and drops what an earlier one left.
void start();

// Ends the recording and writes it: the JSON trace event format of Chrome, one complete event
// ("ph": "X") a span, microseconds since start(). Spans that lie on one thread or track nest: each
// lies within another or beside it. At most 2^20 spans are kept; "dropped_spans" says how many more
// there were.
Result<void> save(const std::filesystem::path& path);

// Facts shown beside a span.
using Arguments = std::vector<std::pair<std::string, Json>>;

// Names the calling thread in the trace; default "thread N".
void name_thread(std::string name);

// Tracks beside the CPU threads.
enum class Track {
    passes,  // of the graphics device, by its own timestamps
    copies,  // uploads and read-backs, likewise
    compile, // first uses of pipelines, in which drivers may compile
};

// A span on a track; ignored when nothing is recorded. start_ns <= end_ns.
void add(Track track, std::string name, int64_t start_ns, int64_t end_ns, Arguments arguments = {});

// A span on the calling thread, as long as this lives. `name` must outlive the recording.
class Scope {
 public:
    explicit Scope(const char* name) {
        if (on()) [[unlikely]]
            begin(name);
    }
    ~Scope() {
        if (name_) [[unlikely]]
            end();
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

    bool recorded() const { return name_ != nullptr; }
    // Call it only if recorded(), so that no text is made in vain.
    void tell(std::string key, Json value) {
        arguments_.emplace_back(std::move(key), std::move(value));
    }

 private:
    void begin(const char* name);
    void end();

    const char* name_ = nullptr; // null while nothing is recorded
    int64_t start_ns_ = 0;
    Arguments arguments_;
};

} // namespace palpate::profile
