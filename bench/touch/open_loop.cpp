#include "bench/touch/open_loop.h"

#include <ctime>

namespace palpate::touch {

double thread_cpu_us() {
    timespec now{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

haptics::TouchParameters scene_parameters(const Scene& scene) {
    return {.iso = scene.iso, .stiffness_n_per_m = 1000.0};
}

void Player::next(Judge& judge, haptics::TickInput& input) {
    if (scene_.stages.empty())
        return;
    const size_t stage = scene_.stage_at(tick_++);
    if (stage != stage_) {
        judge.exchange(scene_.stages[stage].solid);
        input.scene = &scene_.stages[stage].touch;
    }
    stage_ = stage;
}

Figures open_loop(
    haptics::Algorithm& algorithm, const Scene& scene, const Trajectory& trajectory,
    const haptics::TouchParameters& parameters, bool timed,
    const std::function<void(const haptics::TickInput&, const haptics::TickOutput&)>& watch) {
    Judge judge(scene, parameters.stiffness_n_per_m, trajectory.judge_jumps,
                trajectory.judge_direction, parameters.tool_radius_mm);
    haptics::TickInput input{
        .dt_s = trajectory.tick_s, .scene = &scene.touch, .parameters = &parameters};
    input.tool.position_mm = trajectory.path.front();
    algorithm.reset(input);
    Player player(scene);
    for (const glm::dvec3 x : trajectory.path) {
        player.next(judge, input);
        input.velocity_mm_per_s = (x - input.tool.position_mm) / trajectory.tick_s;
        input.tool.position_mm = x;
        const double before = timed ? thread_cpu_us() : 0.0;
        const haptics::TickOutput output = algorithm.tick(input);
        if (timed)
            judge.seen_cpu(thread_cpu_us() - before);
        judge.see(x, output);
        if (watch)
            watch(input, output);
    }
    return judge.figures();
}

} // namespace palpate::touch
