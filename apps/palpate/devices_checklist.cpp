#include "apps/palpate/devices_checklist.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include "engine/base/log.h"
#include "engine/program/interrupt.h"
#include "engine/program/output.h"
#include "haptics/core/clock.h"

namespace palpate {

namespace {

using haptics::Checklist;

// A line of standard input; empty where nobody types one within a minute.
std::string answer(const std::string& question) {
    fmt::print(stderr, "{}\n", question); // also where messages are off
    constexpr int kPatience_ms = 60'000;
    std::string line;
    for (char c = 0; c != '\n';) {
        pollfd in{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
        if (::poll(&in, 1, kPatience_ms) <= 0 || ::read(STDIN_FILENO, &c, 1) != 1)
            break;
        if (c != '\n')
            line += c;
    }
    return line;
}

Json places_json(const Checklist::Places& places) {
    return {{"low_mm", places.low_mm}, {"high_mm", places.high_mm}, {"step_mm", places.step_mm}};
}

Json json_of(const Checklist& list) {
    const Checklist::Times& t = list.times;
    Json lights = Json::array(), pushes = Json::array();
    for (const auto& [bit, seen] : list.lights)
        lights.push_back({{"bit", bit}, {"seen", seen}});
    for (const Checklist::Push& push : list.pushes)
        pushes.push_back({{"direction", push.direction},
                          {"force_n", Checklist::kForce_n},
                          {"duration_s", Checklist::kPush_s},
                          {"delay_ms", push.delay_ms < 0.0 ? Json() : Json(push.delay_ms)},
                          {"across_mm", push.across_mm},
                          {"was_stopped", push.was_stopped},
                          {"moved_mm", push.moved_mm}});
    return {{"times",
             {{"exchanges", t.count},
              {"without_sample", t.stale},
              {"p50_ms", t.p50_ms},
              {"p95_ms", t.p95_ms},
              {"p99_ms", t.p99_ms},
              {"max_ms", t.max_ms},
              {"bin_ms", Checklist::kBin_ms},
              {"bins", t.bins}}},
            {"was_homed", list.was_homed},
            {"homed_s", list.homed_s < 0.0 ? Json() : Json(list.homed_s)},
            {"at_rest", places_json(list.rest)},
            {"moved", places_json(list.ends)},
            {"lights", std::move(lights)},
            {"pushes", std::move(pushes)}};
}

} // namespace

Result<void> run_devices_test(const ChecklistCommand& command, const haptics::DeviceEntry& entry,
                              Json device) {
    const Interrupt interrupt;
    PALPATE_TRY(const auto opened, haptics::open_device(entry, {.start_ns = haptics::monotonic_ns(),
                                                                .firmware = command.firmware}));
    haptics::ChecklistOptions options{.is_armed = command.is_armed, .move_s = command.move_s};
    if (!options.is_armed && opened->capabilities().max_force_n > 0.0)
        options.is_armed =
            answer(fmt::format("{}: the last step pushes the handle with {:g} N, six times. Type "
                               "yes and Enter to allow it; anything else leaves it out.",
                               entry.name, Checklist::kForce_n)) == "yes";
    const haptics::Owner owner{.tell = [](const std::string& what) { log::info("{}", what); },
                               .ask = answer};
    PALPATE_TRY(const Checklist list, haptics::run_checklist(*opened, haptics::monotonic_clock(),
                                                             options, owner, interrupt.token()));
    Json report{{"device", device}};
    report.update(json_of(list));
    if (!command.page.empty())
        PALPATE_TRY(write_text(command.page, checklist_page(list, entry.name, device)));
    if (!command.report.empty())
        return write_text(command.report, report_text(report));
    return print_report(report_text(report));
}

} // namespace palpate
