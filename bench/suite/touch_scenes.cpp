// Which scenes `palpate bench touch` has, in which storages, and who can feel them.

#include <algorithm>
#include <cmath>
#include <memory>

#include "bench/suite/subject.h"
#include "bench/suite/touch.h"
#include "bench/touch/open_loop.h"
#include "bench/touch/special_cases.h"
#include "engine/base/log.h"
#include "engine/io/volume_io.h"
#include "haptics/field/field.h"
#include "haptics/proxy/swept_mesh.h"

namespace palpate::bench {

namespace {

using Visit = std::function<Result<void>(const touch::Scene& scene, const std::string& stored)>;

constexpr const char* kMr = "/usr/share/mricron/templates/ch2.nii.gz";
constexpr const char* kAtlas = "/usr/share/mricron/templates/aal.nii.gz"; // 116 regions

struct NamedStorage {
    const char* name;
    touch::Storage storage;
};
std::vector<NamedStorage> storages(const TouchPlan& plan) {
    std::vector<NamedStorage> list{{"0.5 mm, f32", {}}};
    if (plan.storages) {
        list.push_back({"0.4 x 0.4 x 1.2 mm, i16",
                        {.spacing_mm = touch::kUneven_mm, .form = touch::Form::grey_i16}});
        list.push_back({"0.5 mm, labels", {.form = touch::Form::labels}});
    }
    return list;
}

void add_mesh(haptics::TouchScene& scene, const touch::Scene& of,
              const haptics::TouchParameters& parameters) {
    const std::optional<Volume>& felt =
        of.storage.form == touch::Form::labels ? scene.labels : scene.grey;
    if (!felt || glm::any(glm::lessThan(felt->size(), glm::uvec3(2))))
        return;
    scene.mesh = std::make_shared<Mesh>(haptics::touch_surface(*felt, parameters));
    const glm::dvec3 spacing = spacing_mm(felt->grid());
    scene.touch_mesh =
        haptics::make_touch_mesh(scene.mesh, 0.5 * std::cbrt(spacing.x * spacing.y * spacing.z));
}

Result<void> visit_scene(touch::Scene scene, const TouchParts& parts, const std::string& stored,
                         const Visit& visit) {
    if (!scene.stages.empty())
        scene.touch = scene.stages.front().touch;
    if (parts.takes(haptics::kTakesMesh)) {
        const haptics::TouchParameters parameters = touch_parameters(scene);
        for (touch::Scene::Stage& stage : scene.stages)
            add_mesh(stage.touch, scene, parameters);
        if (scene.stages.empty())
            add_mesh(scene.touch, scene, parameters);
        else
            scene.touch = scene.stages.front().touch;
    }
    return visit(scene, stored);
}

// A11: the head CT at bone, an MR at half its range, an atlas with 116 regions.
Result<void> visit_patients(const TouchPlan& plan, const TouchParts& parts, const Options& options,
                            Json& notes, const Visit& visit) {
    const auto visit_places = [&](const std::string& name, const Volume& volume, bool labels,
                                  double iso) -> Result<void> {
        const glm::uvec3 size = volume.size();
        const std::string stored = fmt::format("{} x {} x {}, as scanned", size.x, size.y, size.z);
        int number = 0;
        for (const touch::Place& place : touch::places_on(volume, iso, plan.places))
            PALPATE_TRY(
                visit_scene(touch::patient_scene(fmt::format("{}/{}", name, ++number), volume,
                                                 labels, iso, place.mm, place.outside),
                            parts, stored, visit));
        return {};
    };
    if (plan.places == 0 || !(parts.patients || parts.closed_loop))
        return {};
    const auto lacks = [&](const Error& error) {
        notes.push_back(fmt::format("A11 without a volume: {}", error.message));
    };
    if (Result<Sample> ct = head_ct(options.head_ct); ct) {
        const Volume volume =
            plan.ct_side ? resampled(*ct, glm::uvec3(plan.ct_side), "ct").volume : ct->volume;
        PALPATE_TRY(visit_places("ct", volume, false, 300.0));
    } else {
        lacks(ct.error());
    }
    if (const Result<LoadedVolume> mr = load_volume(kMr); mr) {
        const ValueRange range = mr->volume.range();
        const double iso = 0.5 * (double{range.min} + double{range.max});
        PALPATE_TRY(visit_places("mr", mr->volume, false, iso));
    } else {
        lacks(mr.error());
    }
    if (const Result<LoadedVolume> atlas = load_labels(kAtlas); atlas) {
        PALPATE_TRY(visit_places("atlas", atlas->volume, true, 0.5));
    } else {
        lacks(atlas.error());
    }
    return {};
}

} // namespace

TouchPlan touch_plan(const Options& options) {
    if (options.tiny)
        return {40, false, false, 0, 0, 2, 2, 300, 0};
    if (options.full)
        return {8000, true, true, 6, 512, 20, 9, 1'000'000, 24};
    return {1000, false, true, 2, 0, 15, 7, 20'000, 3};
}

Result<void> for_each_touch_scene(const TouchPlan& plan, const TouchParts& parts,
                                  const Options& options, Json& notes, const Visit& visit) {
    for (const NamedStorage& stored : storages(plan)) {
        if (!parts.open_loop && !parts.closed_loop)
            break;
        std::vector<touch::TouchCase> cases = touch::touch_cases(stored.storage, plan.all);
        for (touch::TouchCase& special : touch::special_cases(stored.storage))
            cases.push_back(std::move(special));
        for (const touch::TouchCase& body : cases) {
            if (options.stop.stop_requested())
                return fail("interrupted at {} {}", body.id, body.name);
            PALPATE_TRY(
                visit_scene(touch::make_scene(body, stored.storage), parts, stored.name, visit));
        }
    }
    return visit_patients(plan, parts, options, notes, visit);
}

haptics::TouchParameters touch_parameters(const touch::Scene& scene) {
    haptics::TouchParameters parameters = touch::scene_parameters(scene);
    if (scene.storage.form == touch::Form::labels)
        parameters.source = haptics::TouchSource::labels;
    else if (scene.touch.grey)
        tune(parameters, *scene.touch.grey);
    for (haptics::HapticTransfer& transfer : parameters.transfer)
        transfer = {.strength_n = 3.0};
    if (scene.body.transfer)
        parameters.transfer[0] = *scene.body.transfer;
    parameters.transfer[1] = {}; // no friction
    return parameters;
}

haptics::TouchParameters parameters_of(const haptics::AlgorithmEntry& entry,
                                       const touch::Scene& scene,
                                       const haptics::TouchParameters& shared) {
    haptics::TouchParameters parameters = shared;
    if (entry.takes(haptics::kTakesSamples))
        parameters.tool_radius_mm = 1.5 * touch::voxel_mm(scene.storage);
    return parameters;
}

std::string why_empty(const haptics::AlgorithmEntry& entry, const touch::Scene& scene) {
    const touch::TouchCase& body = scene.body;
    const bool labels = scene.storage.form == touch::Form::labels;
    const auto& by = body.felt_by;
    if (!body.why_not.empty() && (by.empty() || labels))
        return body.why_not;
    if (!by.empty() && std::find(by.begin(), by.end(), entry.name) == by.end())
        return body.why_not;
    if (labels && entry.takes(haptics::kTakesTransfer))
        return "its frame is the gradient of grey values";
    return {};
}

} // namespace palpate::bench
