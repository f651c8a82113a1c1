#pragma once

#include <pybind11/pybind11.h>

// What each file of the module adds to it.
namespace palpate::python {

void bind_volume(pybind11::module_& module);
void bind_mesh(pybind11::module_& module);
void bind_picture(pybind11::module_& module);
void bind_document(pybind11::module_& module);
void bind_segment(pybind11::module_& module);
void bind_measure(pybind11::module_& module);
void bind_touch(pybind11::module_& module);

} // namespace palpate::python
