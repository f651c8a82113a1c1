#include "engine/base/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>

#include "engine/base/log_sink.h"
#include "engine/base/printable.h"

namespace palpate::log {

namespace {

spdlog::level::level_enum spdlog_level(Level level) {
    switch (level) {
        case Level::debug:
            return spdlog::level::debug;
        case Level::info:
            return spdlog::level::info;
        case Level::warning:
            return spdlog::level::warn;
        case Level::error:
            return spdlog::level::err;
    }
    return spdlog::level::err;
}

spdlog::logger& logger() {
    static const std::shared_ptr<spdlog::logger> instance = [] {
        auto made = spdlog::stderr_color_mt("palpate");
        made->set_pattern("palpate: %^%l%$: %v");
        return made;
    }();
    return *instance;
}

std::atomic<Sink> g_sink{nullptr};

} // namespace

void set_sink(Sink sink) {
    g_sink = sink;
}

void set_level(Level level) {
    logger().set_level(spdlog_level(level));
}

void write(Level level, const std::string& message) {
    if (!logger().should_log(spdlog_level(level)))
        return;
    if (const Sink sink = g_sink)
        return sink(level, printable(message));
    logger().log(spdlog_level(level), "{}", printable(message));
}

} // namespace palpate::log
