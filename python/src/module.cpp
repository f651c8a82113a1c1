// palpate._core: the libraries as the Python package palpate uses them. People use the package.

#include "engine/base/option_name.h"
#include "engine/io/sandbox.h"
#include "python/src/bind.h"
#include "python/src/work.h"

PYBIND11_MODULE(_core, module) {
    using namespace palpate::python;
    py::register_exception<Failure>(module, "Error");
    module.attr("version") = PALPATE_VERSION;
    module.def("decoder_program", [] { return palpate::io::decoder_program().string(); });
    module.def("set_decoder_program",
               [](const std::string& path) { palpate::io::set_decoder_program(path); });
    take_messages();
    palpate::set_option_style(palpate::OptionStyle::keywords);
    bind_volume(module);
    bind_mesh(module);
    bind_picture(module);
    bind_document(module);
    bind_segment(module);
    bind_measure(module);
    bind_touch(module);
}
