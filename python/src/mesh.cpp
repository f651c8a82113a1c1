// Meshes: from volumes and arrays, to arrays and files.

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "engine/base/log.h"
#include "engine/io/mesh_io.h"
#include "engine/io/volume_io.h"
#include "engine/mesh/decimate.h"
#include "engine/mesh/mesh_check.h"
#include "engine/mesh/smooth.h"
#include "engine/mesh/topology.h"
#include "engine/program/surface_labels.h"
#include "engine/surface/marching_cubes.h"
#include "engine/surface/surface_nets.h"
#include "python/src/bind.h"
#include "python/src/work.h"

namespace palpate::python {

namespace {

using MeshPtr = std::shared_ptr<Mesh>;

// A copy that Python owns.
template <class T>
py::array_t<T> array_of(const std::vector<T>& values) {
    return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

// In world millimetres; double, because offsets of kilometres are.
py::array_t<double> vertices_of(const Mesh& mesh) {
    py::array_t<double> out({mesh.positions.size(), size_t{3}});
    auto at = out.mutable_unchecked<2>();
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const glm::dvec4 p = mesh.world_from_mesh * glm::dvec4(mesh.positions[i], 1.0);
        for (int axis = 0; axis < 3; ++axis)
            at(static_cast<py::ssize_t>(i), axis) = p[axis];
    }
    return out;
}

py::array_t<double> normals_of(const Mesh& mesh) {
    py::array_t<double> out({mesh.normals.size(), size_t{3}});
    auto at = out.mutable_unchecked<2>();
    const glm::dmat3 turn = glm::transpose(glm::inverse(glm::dmat3(mesh.world_from_mesh)));
    for (size_t i = 0; i < mesh.normals.size(); ++i) {
        glm::dvec3 n = turn * glm::dvec3(mesh.normals[i]);
        if (const double length = glm::length(n); length > 0.0)
            n /= length;
        for (int axis = 0; axis < 3; ++axis)
            at(static_cast<py::ssize_t>(i), axis) = n[axis];
    }
    return out;
}

// Counter-clockwise seen from outside in the world: turned over where world_from_mesh mirrors.
py::array_t<uint32_t> triangles_of(const Mesh& mesh) {
    py::array_t<uint32_t> out({mesh.triangles.size(), size_t{3}});
    auto at = out.mutable_unchecked<2>();
    const bool mirrors = glm::determinant(glm::dmat3(mesh.world_from_mesh)) < 0.0;
    for (size_t i = 0; i < mesh.triangles.size(); ++i)
        for (int corner = 0; corner < 3; ++corner)
            at(static_cast<py::ssize_t>(i), corner) =
                mesh.triangles[i][mirrors ? 2 - corner : corner];
    return out;
}

using Points = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<int64_t, py::array::c_style | py::array::forcecast>;

MeshPtr mesh_from_arrays(const Points& vertices, const Indices& triangles) {
    for (const py::array* array : std::initializer_list<const py::array*>{&vertices, &triangles})
        if (array->ndim() != 2 || array->shape(1) != 3)
            throw Failure("expected vertices and triangles as arrays of n x 3");
    auto mesh = std::make_shared<Mesh>();
    const auto points = vertices.unchecked<2>();
    const auto corners = triangles.unchecked<2>();
    glm::dvec3 low(0.0), high(0.0);
    for (py::ssize_t i = 0; i < points.shape(0); ++i) {
        const glm::dvec3 p(points(i, 0), points(i, 1), points(i, 2));
        if (!(glm::length(p) < 1e12))
            throw Failure(fmt::format("a mesh: vertex {} is not finite", i));
        low = i == 0 ? p : glm::min(low, p);
        high = i == 0 ? p : glm::max(high, p);
    }
    // Floats near 0 keep more of a millimetre.
    const glm::dvec3 offset = glm::round(0.5 * (low + high));
    for (py::ssize_t i = 0; i < points.shape(0); ++i)
        mesh->positions.emplace_back(glm::dvec3(points(i, 0), points(i, 1), points(i, 2)) - offset);
    mesh->world_from_mesh[3] = glm::dvec4(offset, 1.0);
    for (py::ssize_t i = 0; i < corners.shape(0); ++i) {
        glm::uvec3 triangle;
        for (int corner = 0; corner < 3; ++corner) {
            const int64_t vertex = corners(i, corner);
            if (vertex < 0 || vertex >= points.shape(0))
                throw Failure(
                    fmt::format("a mesh: triangle {} names vertex {}, expected one of 0 .. {}", i,
                                vertex, points.shape(0) - 1));
            triangle[corner] = static_cast<uint32_t>(vertex);
        }
        mesh->triangles.push_back(triangle);
    }
    value_of(check_mesh(*mesh));
    return mesh;
}

MeshPtr surface_of(const LoadedVolume& loaded, double iso, bool correct, bool closed,
                   const py::object& progress) {
    return run<MeshPtr>(progress, [&](const Report& report) -> Result<MeshPtr> {
        const ValueRange range = loaded.volume.range();
        if (!(iso >= range.min && iso <= range.max))
            return fail("expected an iso-value within {:g} .. {:g}, found {:g}", range.min,
                        range.max, iso);
        Mesh mesh = marching_cubes(
            loaded.volume, static_cast<float>(iso),
            {.topology = correct ? SurfaceTopology::correct : SurfaceTopology::classic,
             .closed_at_border = closed,
             .stop = report.stop});
        return std::make_shared<Mesh>(std::move(mesh));
    });
}

MeshPtr label_walls(const LoadedVolume& loaded, uint32_t passes, const py::object& progress) {
    return run<MeshPtr>(progress, [&](const Report& report) -> Result<MeshPtr> {
        const Volume& labels = loaded.volume;
        if (labels.type() != ScalarType::u8 && labels.type() != ScalarType::u16)
            return fail("expected labels of type u8 or u16, found {}", name_of(labels.type()));
        if (const glm::uvec3 size = labels.size(); std::max({size.x, size.y, size.z}) >= 65535)
            return fail("expected fewer than 65535 samples on each axis");
        return std::make_shared<Mesh>(
            surface_nets(labels, {.passes = passes, .stop = report.stop}));
    });
}

MeshPtr smoothed(const MeshPtr& mesh, const std::string& kind, uint32_t passes) {
    return run<MeshPtr>(py::none(), [&](const Report&) -> Result<MeshPtr> {
        auto copy = std::make_shared<Mesh>(*mesh);
        if (kind == "mean")
            mean_filter(*copy, passes);
        else if (kind == "taubin")
            taubin_filter(*copy, passes);
        else if (kind == "sinc" && passes > 0)
            windowed_sinc_filter(*copy, passes);
        else
            return fail("expected mean, taubin or sinc, and passes above 0, found '{}' and {}",
                        kind, passes);
        return copy;
    });
}

MeshPtr decimated(const MeshPtr& mesh, double error_mm, uint64_t least_triangles,
                  const py::object& progress) {
    return run<MeshPtr>(progress, [&](const Report& report) -> Result<MeshPtr> {
        PALPATE_TRY(Decimated made, decimate(*mesh, {.error_mm = error_mm,
                                                     .least_triangles = least_triangles,
                                                     .stop = report.stop,
                                                     .progress = report.progress}));
        return std::make_shared<Mesh>(std::move(made.mesh));
    });
}

} // namespace

void bind_mesh(py::module_& module) {
    py::class_<Mesh, MeshPtr>(module, "Mesh")
        .def_static("from_arrays", mesh_from_arrays)
        .def_property_readonly("vertices", vertices_of)
        .def_property_readonly("normals", normals_of)
        .def_property_readonly("triangles", triangles_of)
        .def_property_readonly("labels", [](const Mesh& m) { return array_of(m.labels); })
        .def_property_readonly("outer_labels",
                               [](const Mesh& m) { return array_of(m.outer_labels); })
        .def("of_label", [](const Mesh& m, uint16_t label) { return surface_of_label(m, label); })
        .def("topology", [](const Mesh& m) { return json_text(json_of(topology(m))); })
        .def("smoothed", smoothed)
        .def("decimated", decimated);
    module.def("surface", surface_of);
    module.def("label_walls", label_walls);
    module.def("load_mesh", [](const std::string& path) {
        return run<MeshPtr>(py::none(), [&](const Report&) -> Result<MeshPtr> {
            PALPATE_TRY(LoadedMesh loaded, load_mesh(path));
            for (const std::string& warning : loaded.warnings)
                log::warning("{}", warning);
            return std::make_shared<Mesh>(std::move(loaded.mesh));
        });
    });
    module.def("save_mesh", [](const std::string& path, const Mesh& mesh, bool ascii) {
        run<void>(py::none(), [&](const Report& report) {
            return save_mesh(path, mesh, {.ascii = ascii, .stop = report.stop});
        });
    });
}

} // namespace palpate::python
