#pragma once

#include <cstddef>
#include <functional>
#include <stop_token>

#include "engine/base/error.h"
#include "engine/volume/volume.h"

namespace palpate {

// Every filter and method of this library takes it beside its input: how it says how far it is, and
// how it is told to end. Work that was stopped returns stopped(), and never a part of a result.
struct Task {
    std::stop_token stop;
    // Share of the work that is done, 0 .. 1, ascending; called from one thread at a time, of any
    // number. May be empty.
    std::function<void(double share)> progress;
    // Methods whose object grows call it as they go on, from their own thread: make() gives the
    // labels that would be the result now (above 0: the object). It costs a pass over the volume,
    // so that whoever looks decides how often. May be empty.
    std::function<void(const std::function<Volume()>& make)> look{};

    // The same task for a part of the work, which goes from one share of the whole to another.
    Task part(double from, double to) const;
};

tl::unexpected<Error> stopped();

// Runs work(i) for 0 <= i < count on all threads, in any order, with progress. False if it was
// stopped: then some were not run.
bool run_all(size_t count, const Task& task, const std::function<void(size_t i)>& work);

// A volume of bricks that make(position) returns, called for every brick on all threads. Its result
// must be a function of the position alone, so that the number of threads changes no bit.
Result<Volume> make_bricks(const Grid& grid, ScalarType type, const Task& task,
                           const std::function<BrickPtr(glm::uvec3 position)>& make);

} // namespace palpate
