// Measures and comparisons; results are JSON texts.

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "engine/program/compare_json.h"
#include "engine/program/compare_labels.h"
#include "engine/program/measure_labels.h"
#include "python/src/bind.h"
#include "python/src/work.h"

namespace palpate::python {

namespace {

// `measures`: the JSON text of a list, as in a project.
std::string measured(const LoadedVolume& loaded, const std::string& measures,
                     const std::shared_ptr<LoadedVolume>& labels, uint32_t histogram,
                     const py::object& progress) {
    return run<std::string>(progress, [&](const Report& report) -> Result<std::string> {
        PALPATE_TRY(const Json list, parse_json(measures, "measures"));
        JsonErrors errors{"measures", {}};
        MeasureReport out;
        for (const JsonValue& item : JsonValue(list, "", errors).items(0, 100000)) {
            Measure one = read_measure(item);
            if (errors.first)
                return tl::unexpected<Error>(*errors.first);
            std::optional<Measured> found = measure(one, loaded.volume, report.stop);
            if (!found)
                return fail("stopped before all was measured");
            out.measures.push_back({std::move(one), std::move(*found)});
        }
        if (errors.first)
            return tl::unexpected<Error>(*errors.first);
        if (labels) {
            const ScalarType type = labels->volume.type();
            if (type != ScalarType::u8 && type != ScalarType::u16)
                return fail("expected labels of type u8 or u16, found {}", name_of(type));
            if (histogram > 65536)
                return fail("histogram: expected at most 65536 bins, found {}", histogram);
            PALPATE_TRY(out.labels,
                        measured_labels(*labels, loaded.volume, histogram, report.stop));
            out.histogram_range = loaded.volume.range();
        }
        return json_text(report_json(out));
    });
}

std::string compared_volumes(const LoadedVolume& first, const LoadedVolume& second, double bound) {
    return run<std::string>(py::none(), [&](const Report&) -> Result<std::string> {
        if (!(bound >= 0.0))
            return fail("bound: expected a number of 0 or above, found {}", bound);
        PALPATE_TRY(const VolumeDifference found,
                    compare_volumes(first.volume, second.volume, bound));
        Json json{
            {"kind", "volume"}, {"geometry_mm", found.geometry_mm}, {"same_type", found.same_type}};
        json.update(json_of(samples_of(found, sample_count(first.volume.grid()))));
        return json_text(json);
    });
}

std::string compared_labels(const LoadedVolume& first, const LoadedVolume& truth,
                            double tolerance_mm, const py::object& progress) {
    return run<std::string>(progress, [&](const Report& report) -> Result<std::string> {
        if (!(tolerance_mm >= 0.0))
            return fail("tolerance_mm: expected a number of 0 or above, found {}", tolerance_mm);
        PALPATE_TRY(
            const LabelComparison found,
            compare_label_maps(first.volume, truth.volume, {}, {.tolerance_mm = tolerance_mm},
                               {report.stop, report.progress}));
        Json json{{"kind", "labels"}};
        json.update(found.json);
        return json_text(json);
    });
}

std::string compared_meshes(const Mesh& first, const Mesh& second) {
    return run<std::string>(py::none(), [&](const Report&) -> Result<std::string> {
        if (first.triangles.empty() || second.triangles.empty())
            return fail("expected two meshes with triangles");
        const double tolerance_mm = distance_tolerance_mm(first);
        const MeshDistance found = compare_meshes(first, second, {.tolerance_mm = tolerance_mm});
        const double least = found.hausdorff_mm();
        return json_text(mesh_json(first, second, found, {least, least + tolerance_mm}));
    });
}

// Pictures as arrays (height, width, 3) of display values, row-major.
using Pixels = py::array_t<float, py::array::c_style | py::array::forcecast>;

Image image_of(const Pixels& pixels) {
    if (pixels.ndim() != 3 || pixels.shape(2) != 3 || pixels.size() == 0)
        throw Failure("expected a picture as an array of height x width x 3");
    if (pixels.shape(0) > 65536 || pixels.shape(1) > 65536)
        throw Failure("expected a picture of at most 65536 pixels on a side");
    Image image = make_image({pixels.shape(1), pixels.shape(0)}, {"R", "G", "B"});
    std::copy_n(pixels.data(), image.samples.size(), image.samples.begin());
    return image;
}

std::string compared_pictures(const Pixels& first, const Pixels& second, double bound) {
    const Image a = image_of(first), b = image_of(second);
    return run<std::string>(py::none(), [&](const Report&) -> Result<std::string> {
        PALPATE_TRY(const ImageDifference found, compare_images(a, b, bound));
        Json json{{"kind", "image"}};
        json.update(json_of(found));
        return json_text(json);
    });
}

} // namespace

void bind_measure(py::module_& module) {
    module.def("measure", measured);
    module.def("compare_volumes", compared_volumes);
    module.def("compare_labels", compared_labels);
    module.def("compare_meshes", compared_meshes);
    module.def("compare_pictures", compared_pictures);
}

} // namespace palpate::python
