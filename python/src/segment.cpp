// Filters and segmentation methods, by their tables.

#include <pybind11/stl.h>

#include "engine/io/volume_io.h"
#include "engine/net/ask_net.h"
#include "engine/segment/filters.h"
#include "engine/segment/methods.h"
#include "python/src/bind.h"
#include "python/src/work.h"

namespace palpate::python {

namespace {

using VolumePtr = std::shared_ptr<LoadedVolume>;

Task task_of(const Report& report) {
    return {report.stop, report.progress};
}

VolumePtr volume_ptr(Volume volume, std::string modality = "") {
    return std::make_shared<LoadedVolume>(
        LoadedVolume{std::move(volume), {}, {}, std::move(modality), {}, {}});
}

std::vector<py::dict> filter_table() {
    std::vector<py::dict> table;
    for (const Filter& filter : filters()) {
        py::dict row;
        row["name"] = filter.name;
        row["purpose"] = filter.purpose;
        row["arguments"] = filter_arguments(filter);
        row["ranges"] = filter_ranges(filter);
        row["result"] = filter.type;
        table.push_back(row);
    }
    return table;
}

VolumePtr filtered(const LoadedVolume& loaded, const std::string& name, const std::string& values,
                   const std::map<std::string, VolumePtr>& others,
                   const std::vector<uint16_t>& locked, const py::object& progress) {
    return run<VolumePtr>(progress, [&](const Report& report) -> Result<VolumePtr> {
        std::string names;
        for (const Filter& filter : filters()) {
            names += (names.empty() ? "" : ", ") + std::string(filter.name);
            if (filter.name != name)
                continue;
            Result<FilterValues> read = read_filter_values(filter, values);
            std::map<std::string, Volume> volumes;
            for (const auto& [other, volume] : others)
                volumes.emplace(other, volume->volume);
            if (read) {
                read->others = &volumes;
                read->locked = locked;
            }
            Result<Volume> made =
                read ? run_filter(filter, loaded.volume, *read, task_of(report)) : pass_on(read);
            if (!made)
                return fail("{}: {}", name, made.error().message);
            return volume_ptr(std::move(*made), loaded.modality);
        }
        return fail("expected a filter, one of {}, found '{}'", names, name);
    });
}

std::vector<py::dict> method_table() {
    std::vector<py::dict> table;
    for (const SegmentMethod& method : segment_methods()) {
        py::dict row, parameters;
        for (const MethodParameter& p : method.parameters) {
            py::dict one;
            one["purpose"] = p.purpose;
            one["unit"] = p.unit;
            one["least"] = p.least;
            one["most"] = p.most;
            one["default"] = p.fallback_text ? py::object(py::str(p.fallback_text))
                                             : py::object(py::float_(p.fallback));
            parameters[p.name] = one;
        }
        row["name"] = method.name;
        row["purpose"] = method.purpose;
        row["takes_seeds"] = method.takes_seeds;
        row["parameters"] = parameters;
        table.push_back(row);
    }
    return table;
}

struct SegmentResult {
    VolumePtr labels, cost, strength;
    std::vector<std::string> notes;
};

// Seeds: the text of a seed file, or a label map; neither for methods without.
SegmentResult segmented(const LoadedVolume& loaded, const std::string& name,
                        const std::string& seed_text, const VolumePtr& seed_labels,
                        uint16_t background, const std::map<std::string, double>& values,
                        const py::object& progress) {
    return run<SegmentResult>(progress, [&](const Report& report) -> Result<SegmentResult> {
        const SegmentMethod* method = find_segment_method(name);
        if (!method)
            return fail("expected a segmentation method (palpate.methods() lists them), found '{}'",
                        name);
        SegmentInput input{loaded.volume, {}, {}, background};
        if (!seed_text.empty()) {
            PALPATE_TRY(SeedFile seeds, parse_seeds(seed_text, "seeds"));
            PALPATE_TRY(input.seeds, seed_map(loaded.volume, seeds, "seeds"));
            input.balls = std::move(seeds.balls);
            if (background == 0)
                input.background = seeds.background;
        } else if (seed_labels) {
            PALPATE_TRY(input.seeds, checked_seeds(loaded.volume, seed_labels->volume, "seeds"));
        }
        PALPATE_TRY(Segmented made,
                    segment(*method, input, {values.begin(), values.end()}, task_of(report)));
        SegmentResult out{volume_ptr(std::move(made.labels)), {}, {}, std::move(made.notes)};
        if (made.cost)
            out.cost = volume_ptr(std::move(*made.cost));
        if (made.strength)
            out.strength = volume_ptr(std::move(*made.strength));
        return out;
    });
}

// How a net is asked.
struct NetQuery {
    std::string send_to, key, model;
    bool consent = false;
    double timeout_s = 60.0;
};

SegmentResult by_net(const LoadedVolume& loaded, const NetQuery& query,
                     const std::string& seed_text, const VolumePtr& seed_labels,
                     uint16_t background, const py::object& progress) {
    return run<SegmentResult>(progress, [&](const Report& report) -> Result<SegmentResult> {
        const Volume& volume = loaded.volume;
        NetServer server;
        PALPATE_TRY(server.url, server_url(query.send_to));
        if (!query.key.empty()) {
            PALPATE_TRY(server.key, server_key(query.key));
        }
        if (!(query.timeout_s >= 0.1 && query.timeout_s <= 86400.0))
            return fail("timeout_s: expected 0.1 .. 86400, found {:g}", query.timeout_s);
        server.limits.quiet = std::chrono::milliseconds(int64_t(query.timeout_s * 1000.0));
        if (!query.consent)
            return fail("{}; consent=True agrees", sending_sentence(volume, server));
        NetSeeds seeds;
        seeds.background = background;
        if (!seed_text.empty()) {
            PALPATE_TRY(const SeedFile file, parse_seeds(seed_text, "seeds"));
            PALPATE_TRY(seed_map(volume, file, "seeds")); // all lie within
            for (const SeedBall& ball : file.balls)
                seeds.points[ball.label].push_back(
                    glm::uvec3(glm::clamp(glm::round(index_point(volume.grid(), ball.center_mm)),
                                          glm::dvec3(0.0), glm::dvec3(volume.size()) - 1.0)));
            if (background == 0)
                seeds.background = file.background;
        } else if (seed_labels) {
            PALPATE_TRY(seeds.drawn, checked_seeds(volume, seed_labels->volume, "seeds"));
        }
        PALPATE_TRY(const FoundNet found, find_net(server, report.stop));
        std::optional<MonaiModel> model;
        if (!found.is_interactive) {
            PALPATE_TRY(model, model_of(found, query.model));
        }
        const MonaiModel* chosen = model ? &*model : nullptr;
        PALPATE_TRY(Volume labels,
                    ask_net(found, chosen, volume, seeds, report.stop, report.progress));
        return SegmentResult{
            volume_ptr(std::move(labels)), {}, {}, {license_sentence(found, chosen)}};
    });
}

} // namespace

void bind_segment(py::module_& module) {
    module.def("filters", filter_table);
    module.def("filter", filtered);
    module.def("methods", method_table);
    module.def("segment", [](const LoadedVolume& volume, const std::string& method,
                             const std::string& seed_text, const VolumePtr& seed_labels,
                             uint16_t background, const std::map<std::string, double>& values,
                             const py::object& progress) {
        SegmentResult made =
            segmented(volume, method, seed_text, seed_labels, background, values, progress);
        return py::make_tuple(made.labels, made.cost, made.strength, made.notes);
    });
    module.def(
        "segment_by_net",
        [](const LoadedVolume& volume, const std::string& send_to, const std::string& key,
           const std::string& model, bool consent, double timeout_s, const std::string& seed_text,
           const VolumePtr& seed_labels, uint16_t background, const py::object& progress) {
            const SegmentResult made = by_net(volume, {send_to, key, model, consent, timeout_s},
                                              seed_text, seed_labels, background, progress);
            return py::make_tuple(made.labels, made.notes);
        });
}

} // namespace palpate::python
