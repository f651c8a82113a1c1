#include "engine/segment/task.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <mutex>

#include "engine/volume/builder.h"

namespace palpate {

Task Task::part(double from, double to) const {
    if (!progress)
        return *this;
    return {stop, [whole = progress, from, to](double share) { whole(from + (to - from) * share); },
            look};
}

tl::unexpected<Error> stopped() {
    return fail("stopped before it was done");
}

bool run_all(size_t count, const Task& task, const std::function<void(size_t i)>& work) {
    std::atomic<size_t> done{0};
    std::atomic<bool> left_out{false};
    std::mutex one_at_a_time;
    size_t shown = 0;
    tbb::parallel_for(size_t{0}, count, [&](size_t i) {
        if (task.stop.stop_requested()) {
            left_out = true;
            return;
        }
        work(i);
        const size_t now = ++done;
        if (!task.progress || now * 100 / count == (now - 1) * 100 / count)
            return;
        const std::lock_guard lock(one_at_a_time);
        if (now > shown) {
            shown = now;
            task.progress(double(now) / double(count));
        }
    });
    return !left_out;
}

Result<Volume> make_bricks(const Grid& grid, ScalarType type, const Task& task,
                           const std::function<BrickPtr(glm::uvec3 position)>& make) {
    VolumeBuilder builder(grid, type);
    const glm::uvec3 bricks = builder.brick_count();
    const bool all = run_all(size_t{bricks.x} * bricks.y * bricks.z, task, [&](size_t i) {
        const glm::uvec3 position(i % bricks.x, i / bricks.x % bricks.y,
                                  i / (size_t{bricks.x} * bricks.y));
        builder.set_brick(position, make(position));
    });
    if (!all)
        return stopped();
    return builder.finish();
}

} // namespace palpate
