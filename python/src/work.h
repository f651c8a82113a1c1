#pragma once

#include <pybind11/pybind11.h>

#include <functional>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <string>

#include "engine/base/error.h"

namespace palpate::python {

namespace py = pybind11;

// palpate.Error in Python: one sentence.
class Failure : public std::runtime_error {
 public:
    using std::runtime_error::runtime_error;
};

template <class T>
T value_of(Result<T> result) {
    if (!result)
        throw Failure(result.error().message);
    if constexpr (!std::is_void_v<T>)
        return std::move(*result);
}

// A stop that long work looks at, and the progress that it tells.
struct Report {
    std::stop_token stop;
    std::function<void(double share)> progress; // 0 .. 1; any thread, one at a time
};

// Runs `work` on another thread without the GIL. Meanwhile the caller's thread hands the
// progress to a Python callable (or None) and looks for Ctrl-C; either one raising stops the work,
// and is raised when the work has ended. What `work` throws becomes a Failure.
void run_aside(const py::object& progress, const std::function<void(const Report&)>& work);

// The same for work with a result.
template <class T>
T run(const py::object& progress, const std::function<Result<T>(const Report&)>& work) {
    std::optional<Result<T>> result;
    run_aside(progress, [&](const Report& report) { result.emplace(work(report)); });
    return value_of(std::move(*result));
}

// Messages of the libraries go to Python's warnings and logging, at the end of run_aside().
void take_messages();

} // namespace palpate::python
