#include "engine/base/profile.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <mutex>
#include <span>

#include "engine/base/assert.h"
#include "engine/base/file.h"

namespace palpate::profile {

namespace detail {
std::atomic<bool> recording{false};
}

namespace {

constexpr size_t kMostSpans = size_t{1} << 20;
constexpr std::array<const char*, 3> kTrackNames{"passes", "copies", "pipelines, first use"};
constexpr int kCpu = 1, kDevice = 2; // processes of the trace

struct Span {
    std::string name;
    int64_t start_ns, end_ns;
    Arguments arguments;
};

// One line of the trace. A thread writes to its own alone, so the lock is never waited for while
// recording goes on.
struct Line {
    std::mutex mutex;
    std::string name;
    std::vector<Span> spans;
};

struct Recorder {
    std::mutex mutex; // guards `threads` and `begun`
    std::vector<std::shared_ptr<Line>> threads;
    size_t begun = 0; // threads that ever had a line
    std::array<Line, kTrackNames.size()> tracks;
    std::atomic<size_t> spans{0};
    std::atomic<int64_t> start_ns{0};
};

Recorder& recorder() {
    static Recorder* const one = new Recorder; // outlives every thread
    return *one;
}

// The line of a thread, which stays after its end where it has spans. Without them it goes, so that
// a process that begins a thread for each piece of work does not grow.
struct OwnLine {
    std::shared_ptr<Line> line = std::make_shared<Line>();

    OwnLine() {
        const std::lock_guard lock(recorder().mutex);
        recorder().threads.push_back(line);
        line->name = fmt::format("thread {}", ++recorder().begun);
    }
    ~OwnLine() {
        const std::lock_guard lock(recorder().mutex);
        const std::lock_guard line_lock(line->mutex);
        if (line->spans.empty())
            std::erase(recorder().threads, line);
    }
    OwnLine(const OwnLine&) = delete;
    OwnLine& operator=(const OwnLine&) = delete;
};

Line& own_line() {
    thread_local const OwnLine own;
    return *own.line;
}

void put(Line& line, Span span) {
    if (recorder().spans.fetch_add(1, std::memory_order_relaxed) >= kMostSpans)
        return;
    const std::lock_guard lock(line.mutex);
    line.spans.push_back(std::move(span));
}

// Nanoseconds as microseconds, to the last digit.
std::string microseconds(int64_t ns) {
    return fmt::format("{}.{:03}", ns / 1000, ns % 1000);
}

std::string metadata(const char* what, int process, size_t line, std::string_view name) {
    return fmt::format(R"({{"ph":"M","name":"{}","pid":{},"tid":{},"args":{{"name":{}}}}})", what,
                       process, line, json_line(name));
}

// Appends one event a span, outer ones first.
void append(std::vector<std::string>& events, Line& line, int process, size_t number) {
    const std::lock_guard lock(line.mutex);
    if (line.spans.empty())
        return;
    events.push_back(metadata("thread_name", process, number, line.name));
    std::stable_sort(line.spans.begin(), line.spans.end(), [](const Span& a, const Span& b) {
        return a.start_ns != b.start_ns ? a.start_ns < b.start_ns : a.end_ns > b.end_ns;
    });
    const int64_t zero = recorder().start_ns;
    for (const Span& span : line.spans) {
        std::string arguments;
        for (const auto& [key, value] : span.arguments)
            arguments += fmt::format("{}{}:{}", arguments.empty() ? "" : ",", json_line(key),
                                     json_line(value));
        events.push_back(fmt::format(
            R"({{"ph":"X","name":{},"cat":"{}","pid":{},"tid":{},"ts":{},"dur":{},"args":{{{}}}}})",
            json_line(span.name), process == kCpu ? "cpu" : "device", process, number,
            microseconds(span.start_ns - zero), microseconds(span.end_ns - span.start_ns),
            arguments));
    }
}

} // namespace

int64_t now_ns() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

void start() {
    Recorder& all = recorder();
    detail::recording = false;
    const std::lock_guard lock(all.mutex);
    const auto clear = [](Line& line) {
        const std::lock_guard line_lock(line.mutex);
        line.spans.clear();
    };
    for (auto& thread : all.threads)
        clear(*thread);
    for (size_t i = 0; i < all.tracks.size(); ++i) {
        clear(all.tracks[i]);
        all.tracks[i].name = kTrackNames[i];
    }
    all.spans = 0;
    all.start_ns = now_ns();
    detail::recording = true;
}

Result<void> save(const std::filesystem::path& path) {
    detail::recording = false;
    Recorder& all = recorder();
    std::vector<std::string> events{metadata("process_name", kCpu, 0, "CPU"),
                                    metadata("process_name", kDevice, 0, "graphics device")};
    {
        const std::lock_guard lock(all.mutex);
        for (size_t i = 0; i < all.threads.size(); ++i)
            append(events, *all.threads[i], kCpu, i + 1);
    }
    for (size_t i = 0; i < all.tracks.size(); ++i)
        append(events, all.tracks[i], kDevice, i + 1);
    const size_t met = all.spans;
    std::string text = "{\"displayTimeUnit\":\"ms\",\n\"otherData\":{\"dropped_spans\":" +
                       fmt::format("{}", met - std::min(met, kMostSpans)) +
                       "},\n\"traceEvents\":[\n";
    for (size_t i = 0; i < events.size(); ++i)
        text += events[i] + (i + 1 < events.size() ? ",\n" : "\n");
    text += "]}\n";
    return save_bytes(path, std::as_bytes(std::span(text)));
}

void name_thread(std::string name) {
    Line& line = own_line();
    const std::lock_guard lock(line.mutex);
    line.name = std::move(name);
}

void add(Track track, std::string name, int64_t start_ns, int64_t end_ns, Arguments arguments) {
    if (!on())
        return;
    PALPATE_ASSERT_CMP(start_ns, <=, end_ns);
    put(recorder().tracks[static_cast<size_t>(track)],
        {std::move(name), start_ns, end_ns, std::move(arguments)});
}

void Scope::begin(const char* name) {
    name_ = name;
    start_ns_ = now_ns();
}

void Scope::end() {
    // A span that an earlier recording began, or that this one no longer wants, is not kept.
    if (on() && start_ns_ >= recorder().start_ns)
        put(own_line(), {name_, start_ns_, now_ns(), std::move(arguments_)});
}

} // namespace palpate::profile
