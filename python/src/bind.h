#pragma once

#include <pybind11/pybind11.h>

// Each file adds one part of the module.
namespace palpate::python {

void bind_volume(pybind11::module_& module);
void bind_mesh(pybind11::module_& module);
void bind_picture(pybind11::module_& module);
void bind_document(pybind11::module_& module);
void bind_segment(pybind11::module_& module);
void bind_measure(pybind11::module_& module);
void bind_touch(pybind11::module_& module);

} // namespace palpate::python
