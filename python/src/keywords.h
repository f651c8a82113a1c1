#pragma once

#include <pybind11/pybind11.h>

#include <CLI/CLI.hpp>

namespace palpate::python {

namespace py = pybind11;

// Gives the options of a command what keyword arguments say, with _ for -, and checks all of them
// as a command line is checked. None and False leave an option out, True sets a flag. A value is a
// number, a text or a path; numbers or texts in sequences; a dict where an option takes JSON. What
// is wrong is a Failure that names the keyword.
void take_keywords(CLI::App& app, const py::dict& keywords);

} // namespace palpate::python
