#include "apps/palpate/touch_said.h"

#include <algorithm>
#include <cmath>

#include "engine/base/log.h"
#include "engine/program/setting_options.h"
#include "engine/volume/changes.h"

namespace palpate {

namespace {

// How far apart the samples of a ball lie: what is smaller passes between them.
std::string sample_gap_text(const TouchOptions& o) {
    constexpr double kSphere = 12.566370614359172; // area over radius^2
    if (o.parameters.tool_radius_mm == 0.0 ||
        !haptics::find_algorithm(o.algorithm)->takes(haptics::kTakesSamples))
        return {};
    return fmt::format(
        "; the {} --samples of a --radius of {:g} mm lie about {:.2g} mm apart, and "
        "what is smaller may pass between them",
        o.parameters.tool_samples, o.parameters.tool_radius_mm,
        o.parameters.tool_radius_mm * std::sqrt(kSphere / o.parameters.tool_samples));
}

} // namespace

void warn_of_idle_options(const CLI::App& app, const TouchOptions& o,
                          const haptics::AlgorithmEntry& algorithm, haptics::TouchSource source,
                          const haptics::DeviceEntry& device) {
    using namespace haptics; // Takes
    const auto lacks = [&](Takes what, std::vector<std::string> options) {
        return IdleOptions{!algorithm.takes(what), std::move(options),
                           fmt::format("of {}", takers_text(what))};
    };
    std::vector<IdleOptions> idle = idle_settings<TouchParameters>(
        kTouchSettings, algorithm.bits, takers_text, "with --algorithm none");
    idle.insert(
        idle.end(),
        {{o.motion.live, {"--real-time"}, "--live runs on the wall clock"},
         lacks(kTakesTransfer, {"--transfer", "--transfer-across"}),
         lacks(kTakesField, {"--field"}),
         lacks(kTakesOpacity, {"--opacity"}),
         lacks(kTakesMesh, {"--mesh"}),
         lacks(kTakesTool, {"--felt-tool"}),
         {!edits(o), {"--tool"}, "without --edit and --drill"},
         {!edits(o) || o.output.empty(), {"--journal"}, "without -o and --edit or --drill"},
         {strokes_of(o).in_project(), {"--journal"}, "the project keeps the strokes"},
         {!o.motion.trajectory.empty() && !drills_by_itself(o),
          {"--edit", "--drill"},
          "a trajectory presses no button"},
         {!algorithm.feels(), {"--source"}, "with --algorithm none"},
         {algorithm.feels() && !edits(o), {"--vibration"}, "nothing is removed without an edit"},
         {!edits(o), {"--sound"}, "nothing is removed without an edit"},
         {o.feel.second_edit.empty(), {"--second-tool"}, "without --second-edit"},
         {algorithm.is_guide, {"--iso", "--source", "--label-feel"}, "with --guide"},
         {source == haptics::TouchSource::labels, {"--iso"}, "labels are felt"},
         {source != haptics::TouchSource::labels, {"--label-feel"}, "grey values are felt"},
         {algorithm.takes(kTakesSamples) && o.feel.felt_tool.empty() &&
              o.parameters.tool_radius_mm == 0.0,
          {"--samples"},
          "a --radius of 0 is a point"},
         {!o.feel.felt_tool.empty() && algorithm.takes(kTakesTool),
          {"--radius"},
          "with --felt-tool"},
         {device.driver != std::string_view("simulated"),
          {"--grip", "--delay"},
          "of simulated devices"}});
    warn_of_idle(app, idle);
}

void warn_of_what_was_felt(const haptics::TouchSummary& s, const TouchOptions& o,
                           const haptics::HandPath& path, const Grid& grid) {
    if (!o.motion.live && s.began_s > 0.0 && std::isfinite(s.began_s))
        log::warning(
            "force began {:.3f} s into the path: the soft start waited until the hand was free",
            s.began_s);
    const haptics::AlgorithmEntry& algorithm = *haptics::find_algorithm(o.algorithm);
    if ((s.contact_ticks > 0 && s.most_force_n > 0.0) || !algorithm.feels())
        return;
    if (algorithm.takes(haptics::kTakesTransfer) && o.feel.transfer.empty() &&
        o.feel.transfer_across.empty())
        log::warning("nothing was felt: --transfer is 0");
    else if (s.contact_ticks == 0)
        log::warning("nothing was touched: the path meets no surface at --iso; {}{}",
                     place_text(path, grid), sample_gap_text(o));
    else
        log::warning("nothing was felt: the force was always 0");
}

void warn_of_idle_edit(const Volume& before, const Volume& after, const haptics::HandPath& path,
                       const TouchOptions& o) {
    if (!changed_bricks(before, after).empty())
        return;
    const bool pressed = std::any_of(path.poses().begin(), path.poses().end(),
                                     [](const haptics::HandPose& p) { return p.buttons & 1u; });
    log::warning(
        "--edit or --drill changed no sample: {}",
        drills_by_itself(o)
            ? fmt::format("the hand was never deeper than --drill-threshold {:g} mm, or the "
                          "tool met nothing that it changes",
                          o.parameters.drill_threshold_mm)
        : pressed ? "the tool met nothing that it changes"
                  : "the path presses no button 0 (its column \"button\")");
}

} // namespace palpate
