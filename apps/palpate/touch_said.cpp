#include "apps/palpate/touch_said.h"

#include <algorithm>
#include <cmath>

#include "apps/palpate/setting_options.h"
#include "engine/base/log.h"
#include "engine/volume/changes.h"

namespace palpate {

namespace {

// How far apart the samples of a ball lie: what is smaller passes between them.
std::string sample_gap_text(const TouchOptions& o) {
    constexpr double kSphere = 12.566370614359172; // area over radius^2
    if (o.parameters.tool_radius_mm == 0.0 ||
        !(o.algorithm == "swept-tool" || o.algorithm == "vidholm-2004"))
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
    const std::string_view name = algorithm.name;
    const bool is_tool = name == "swept-tool", is_sphere = is_tool || name == "vidholm-2004",
               has_window = name == "koerner-1999" || name == "swept-local" || name == "swept-mesh";
    std::vector<IdleOptions> idle =
        idle_settings<haptics::TouchParameters>(haptics::kTouchSettings, name);
    idle.insert(
        idle.end(),
        {{o.motion.live, {"--real-time"}, "--live runs on the wall clock"},
         {!name.starts_with("wish-2008-"), {"--transfer", "--transfer-across"}, "of wish-2008-*"},
         {name != "wish-2008-vector", {"--field"}, "of wish-2008-vector"},
         {!has_window, {"--opacity"}, "of koerner-1999, swept-local and swept-mesh"},
         {name != "swept-mesh", {"--mesh"}, "of swept-mesh"},
         {!is_tool, {"--felt-tool"}, "of swept-tool"},
         {!edits(o), {"--tool"}, "without --edit and --drill"},
         {!edits(o) || o.output.empty(), {"--journal"}, "without -o and --edit or --drill"},
         {strokes_of(o).in_project(), {"--journal"}, "the project keeps the strokes"},
         {!o.motion.trajectory.empty() && !drills_by_itself(o),
          {"--edit", "--drill"},
          "a trajectory presses no button"},
         {name == "none", {"--source"}, "with --algorithm none"},
         {name != "none" && !edits(o), {"--vibration"}, "nothing is removed without an edit"},
         {!edits(o), {"--sound"}, "nothing is removed without an edit"},
         {o.feel.second_edit.empty(), {"--second-tool"}, "without --second-edit"},
         {algorithm.is_guide, {"--iso", "--source", "--label-feel"}, "with --guide"},
         {source == haptics::TouchSource::labels, {"--iso"}, "labels are felt"},
         {source != haptics::TouchSource::labels, {"--label-feel"}, "grey values are felt"},
         {is_sphere && o.feel.felt_tool.empty() && o.parameters.tool_radius_mm == 0.0,
          {"--samples"},
          "a --radius of 0 is a point"},
         {!o.feel.felt_tool.empty() && is_tool, {"--radius"}, "with --felt-tool"},
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
    if ((s.contact_ticks > 0 && s.most_force_n > 0.0) || o.algorithm == "none")
        return;
    if (o.algorithm.starts_with("wish-2008-") && o.feel.transfer.empty() &&
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
