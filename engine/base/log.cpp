#include "engine/base/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

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

} // namespace

void set_level(Level level) {
    logger().set_level(spdlog_level(level));
}

void write(Level level, const std::string& message) {
    logger().log(spdlog_level(level), "{}", printable(message));
}

} // namespace palpate::log
