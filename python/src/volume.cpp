// Volumes: arrays in and out, files.

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <map>

#include "engine/base/log.h"
#include "engine/io/dicom_structures_write.h"
#include "engine/io/narrow.h"
#include "engine/io/volume_io.h"
#include "engine/program/read_options.h"
#include "engine/volume/box.h"
#include "python/src/bind.h"
#include "python/src/work.h"

namespace palpate::python {

namespace {

using Matrix = py::array_t<double, py::array::c_style | py::array::forcecast>;

Grid grid_of(glm::uvec3 size, const Matrix& affine) {
    if (affine.ndim() != 2 || affine.shape(0) != 4 || affine.shape(1) != 4)
        throw Failure("affine: expected a matrix of 4 x 4");
    Grid grid{size, glm::dmat4(1)};
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            grid.world_from_index[column][row] = affine.at(row, column);
    return grid;
}

py::array_t<double> affine_of(const LoadedVolume& loaded) {
    py::array_t<double> affine({4, 4});
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            affine.mutable_at(row, column) = loaded.volume.grid().world_from_index[column][row];
    return affine;
}

template <class T>
Result<LoadedVolume> kept(const Grid& grid, const void* samples, size_t count) {
    PALPATE_TRY(Volume volume, volume_of_array(grid, packed(grid.size),
                                               std::span(static_cast<const T*>(samples), count)));
    return LoadedVolume{std::move(volume), {}, {}, {}, {}, {}};
}

// The names that NumPy gives types, without the byte order: "u1", "f8".
const std::map<std::string, io::ComponentType> kTypes{
    {"u1", io::ComponentType::u8},  {"i1", io::ComponentType::i8},  {"u2", io::ComponentType::u16},
    {"i2", io::ComponentType::i16}, {"u4", io::ComponentType::u32}, {"i4", io::ComponentType::i32},
    {"u8", io::ComponentType::u64}, {"i8", io::ComponentType::i64}, {"f4", io::ComponentType::f32},
    {"f8", io::ComponentType::f64}};

// `array`: (x, y, z), column-major, of native byte order. Types that a volume stores stay, others
// become the smallest that holds every value, as in a file.
LoadedVolume volume_from_array(const py::array& array, const Matrix& affine,
                               const std::string& modality, bool labels) {
    if (array.ndim() != 3)
        throw Failure(fmt::format("expected an array of 3 dimensions (x, y, z), found {}",
                                  static_cast<int>(array.ndim())));
    if (!(array.flags() & py::array::f_style))
        throw Failure("expected a column-major array");
    glm::uvec3 size;
    for (int axis = 0; axis < 3; ++axis) {
        if (array.shape(axis) < 1 || array.shape(axis) > py::ssize_t{0x7fffffff})
            throw Failure(
                fmt::format("expected samples on each axis, found a shape of {} x {} x {}",
                            array.shape(0), array.shape(1), array.shape(2)));
        size[axis] = static_cast<uint32_t>(array.shape(axis));
    }
    const Grid grid = grid_of(size, affine);
    const std::string name =
        fmt::format("{}{}", array.dtype().kind(), static_cast<int>(array.itemsize()));
    const auto type = kTypes.find(name);
    if (type == kTypes.end())
        throw Failure(
            fmt::format("expected whole or floating-point numbers, found the type '{}'", name));
    const void* samples = array.data();
    const size_t count = sample_count(grid);
    LoadedVolume made = run<LoadedVolume>(py::none(), [&](const Report&) -> Result<LoadedVolume> {
        using enum io::ComponentType;
        const bool checked = labels || type->second == f64;
        if (!checked && type->second == u8)
            return kept<uint8_t>(grid, samples, count);
        if (!checked && type->second == i8)
            return kept<int8_t>(grid, samples, count);
        if (!checked && type->second == u16)
            return kept<uint16_t>(grid, samples, count);
        if (!checked && type->second == i16)
            return kept<int16_t>(grid, samples, count);
        if (!checked && type->second == f32)
            return kept<float>(grid, samples, count);
        if (const glm::dmat4 inverse = glm::inverse(grid.world_from_index);
            !std::isfinite(inverse[0][0]))
            return fail("affine: expected a matrix that has an inverse");
        const io::VoxelClaim claim{.size = size, .type = type->second};
        const size_t bytes = count * io::bytes_per_component(type->second);
        PALPATE_TRY(LoadedVolume narrowed,
                    io::narrow("array", {.grid = grid}, claim,
                               {static_cast<const std::byte*>(samples), bytes},
                               labels ? io::VolumeKind::labels : io::VolumeKind::values,
                               ReadOptions().max_memory_bytes));
        for (const std::string& warning : narrowed.warnings)
            log::warning("{}", warning);
        return narrowed;
    });
    made.modality = modality;
    return made;
}

// A box of samples in the volume's own type, (x, y, z), column-major. No data is NaN.
py::array samples_of(const LoadedVolume& loaded, std::array<uint32_t, 3> first,
                     std::array<uint32_t, 3> size) {
    const Volume& volume = loaded.volume;
    const glm::uvec3 begin(first[0], first[1], first[2]), count(size[0], size[1], size[2]);
    for (int axis = 0; axis < 3; ++axis)
        if (count[axis] == 0 || uint64_t{begin[axis]} + count[axis] > volume.size()[axis])
            throw Failure(fmt::format(
                "expected a box within {} x {} x {} samples, found one from {}, {}, {} of {} x {} "
                "x {}",
                volume.size().x, volume.size().y, volume.size().z, begin.x, begin.y, begin.z,
                count.x, count.y, count.z));
    return visit_scalar(volume.type(), [&](auto t) -> py::array {
        using T = decltype(t);
        py::array_t<T, py::array::f_style> array({count.x, count.y, count.z});
        const std::span<T> out(array.mutable_data(), static_cast<size_t>(array.size()));
        run<void>(py::none(), [&](const Report&) {
            return copy_out<T>(volume, begin, count, packed(count), out);
        });
        return array;
    });
}

LoadedVolume load_file(const std::string& path, bool labels, std::optional<uint32_t> frame,
                       const std::string& series, bool resample_slices, double max_memory_mib,
                       const py::object& progress) {
    const ReadFlags flags{path, frame ? int64_t{*frame} : -1, series, resample_slices,
                          max_memory_mib};
    return run<LoadedVolume>(
        progress, [&](const Report& report) { return load(flags, labels, report.stop); });
}

ReadOptions reference_options(const std::string& series, const Report& report) {
    ReadOptions options;
    if (!series.empty())
        options.series = series;
    options.stop = report.stop;
    return options;
}

// Names: of labels by their numbers.
void save_dicom(const std::string& path, const LoadedVolume& labels,
                const std::map<uint32_t, std::string>& names, const std::string& reference,
                const std::string& series, const std::string& kind, const std::string& codes,
                const py::object& progress) {
    const std::map<std::string, DicomLabels> kinds{{"seg", DicomLabels::binary},
                                                   {"seg-fractional", DicomLabels::fractional},
                                                   {"seg-labelmap", DicomLabels::label_map},
                                                   {"rtstruct", DicomLabels::binary}};
    const auto found = kinds.find(kind);
    if (found == kinds.end())
        throw Failure(fmt::format(
            "kind: expected seg, seg-fractional, seg-labelmap or rtstruct, found '{}'", kind));
    run<void>(progress, [&](const Report& report) -> Result<void> {
        std::vector<LabelName> all = labels.labels;
        for (const auto& [label, name] : names) {
            const auto there = std::ranges::find(all, label, &LabelName::label);
            (there == all.end() ? all.emplace_back(LabelName{label, {}, {}}) : *there).name = name;
        }
        PALPATE_TRY(const DicomReference series_of,
                    load_dicom_reference(reference, reference_options(series, report)));
        for (const std::string& warning : series_of.warnings)
            log::warning("{}", warning);
        DicomLabelOptions options;
        options.kind = found->second;
        options.frame_of_reference = labels.frame_of_reference;
        options.stop = report.stop;
        if (!codes.empty()) {
            PALPATE_TRY(options.codes, SegmentCodes::load(codes));
        }
        return (kind == "rtstruct" ? save_dicom_structures : save_dicom_labels)(
            path, labels.volume, all, series_of, options);
    });
}

LoadedVolume structures_of_file(const std::string& path, const std::string& reference,
                                const std::string& series, const py::object& progress) {
    return run<LoadedVolume>(progress, [&](const Report& report) -> Result<LoadedVolume> {
        PALPATE_TRY(LoadedVolume loaded,
                    load_structures(path, reference, reference_options(series, report)));
        for (const std::string& warning : loaded.warnings)
            log::warning("{}", warning);
        return loaded;
    });
}

} // namespace

void bind_volume(py::module_& module) {
    using Bound = py::class_<LoadedVolume, std::shared_ptr<LoadedVolume>>;
    Bound(module, "Volume")
        .def_static("from_array", volume_from_array)
        .def("array", samples_of)
        .def_property_readonly("affine", affine_of)
        .def_property_readonly("shape",
                               [](const LoadedVolume& v) {
                                   const glm::uvec3 size = v.volume.size();
                                   return py::make_tuple(size.x, size.y, size.z);
                               })
        .def_property_readonly("spacing",
                               [](const LoadedVolume& v) {
                                   const glm::dvec3 mm = spacing_mm(v.volume.grid());
                                   return py::make_tuple(mm.x, mm.y, mm.z);
                               })
        .def_property_readonly("type",
                               [](const LoadedVolume& v) { return name_of(v.volume.type()); })
        .def_property_readonly("range",
                               [](const LoadedVolume& v) {
                                   const ValueRange range = v.volume.range();
                                   return py::make_tuple(range.min, range.max);
                               })
        .def_property_readonly("no_data_count",
                               [](const LoadedVolume& v) { return v.volume.no_data_count(); })
        .def_property_readonly("version", [](const LoadedVolume& v) { return v.volume.version(); })
        .def_readwrite("modality", &LoadedVolume::modality)
        .def_property_readonly("label_names", [](const LoadedVolume& v) {
            std::map<uint32_t, std::string> names;
            for (const LabelName& label : v.labels)
                names[label.label] = label.name;
            return names;
        });
    module.def("load", load_file);
    module.def("load_structures", structures_of_file);
    module.def("save_dicom", save_dicom);
    module.def("save",
               [](const std::string& path, const LoadedVolume& loaded, const py::object& progress) {
                   run<void>(progress, [&](const Report& report) {
                       return save_volume(path, loaded.volume, report.stop, loaded.modality);
                   });
               });
}

} // namespace palpate::python
