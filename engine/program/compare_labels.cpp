#include "engine/program/compare_labels.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "engine/measure/label_statistics.h"
#include "engine/mesh/label_surfaces.h"

namespace palpate {

namespace {

constexpr double kMm3PerMl = 1000.0;

Json defined(const std::optional<double>& score) {
    return score ? Json(*score) : Json();
}

Json json_of(const LabelScores& scores, double sample_ml) {
    const OverlapScores& o = scores.overlap;
    Json json;
    if (scores.label != 0)
        json["label"] = scores.label;
    json.update(Json{{"voxels", {o.first, o.second}},
                     {"both", o.both},
                     {"volume_ml", {double(o.first) * sample_ml, double(o.second) * sample_ml}},
                     {"dice", o.dice()},
                     {"jaccard", o.jaccard()},
                     {"voe", o.voe()},
                     {"rvd", defined(o.rvd())},
                     {"sensitivity", defined(o.sensitivity())},
                     {"ppv", defined(o.ppv())},
                     {"specificity", defined(o.specificity())},
                     {"box_specificity", defined(o.box_specificity())}});
    if (!scores.surface)
        return json;
    const SurfaceScores& s = *scores.surface;
    json["surface"] = {{"area_mm2", {s.first_mm2, s.second_mm2}},
                       {"mean_mm", defined(s.mean_mm)},
                       {"rms_mm", defined(s.rms_mm)},
                       {"p95_mm", defined(s.p95_mm)},
                       {"largest_mm", defined(s.largest_mm)},
                       {"dice", s.dice}};
    return json;
}

Json json_of(const RunsAgreement& runs) {
    return {{"label", runs.label},
            {"runs", runs.runs},
            {"jaccard_mean", runs.jaccard_mean},
            {"jaccard_least", runs.jaccard_least},
            {"jaccard_cv", defined(runs.jaccard_cv)},
            {"volume_mean_ml", runs.volume_mean_mm3 / kMm3PerMl},
            {"volume_cv", defined(runs.volume_cv)}};
}

// Figures of the closed surface of each label of a mesh with labels, 0 apart.
using LabelFigures = std::map<uint16_t, MeshTopology>;

std::optional<LabelFigures> figures_of_labels(const Mesh& mesh) {
    if (mesh.labels.empty())
        return std::nullopt;
    LabelFigures out;
    for_each_label(mesh, [&](uint16_t label, const Mesh& surface) {
        if (label != 0)
            out[label] = topology(surface);
    });
    return out;
}

Json volume_of(const MeshTopology& whole, const std::optional<LabelFigures>& labels) {
    if (!labels)
        return whole.closed && whole.consistently_oriented ? Json(whole.volume_mm3) : Json();
    double sum = 0.0;
    for (const auto& [label, figures] : *labels)
        sum += figures.volume_mm3;
    return Json(sum);
}

Json json_of(const LabelFigures& first, const LabelFigures& second) {
    std::set<uint16_t> labels;
    for (const LabelFigures* one : {&first, &second})
        for (const auto& [label, figures] : *one)
            labels.insert(label);
    const auto of = [](const LabelFigures& figures, uint16_t label) {
        const auto at = figures.find(label);
        return at != figures.end() ? at->second : MeshTopology();
    };
    Json json = Json::array();
    for (const uint16_t label : labels) {
        const MeshTopology a = of(first, label), b = of(second, label);
        json.push_back({{"label", label},
                        {"triangles", {a.triangles, b.triangles}},
                        {"area_mm2", {a.area_mm2, b.area_mm2}},
                        {"volume_mm3", {a.volume_mm3, b.volume_mm3}}});
    }
    return json;
}

} // namespace

Result<LabelComparison> compare_label_maps(const Volume& first, const Volume& truth,
                                           const std::vector<Volume>& runs,
                                           const LabelScoresOptions& options, const Task& task) {
    PALPATE_TRY(const LabelMapScores scores, label_scores(first, truth, options, task));
    const double sample_ml = sample_mm3(first.grid()) / kMm3PerMl;
    LabelComparison out;
    Json labels = Json::array();
    for (const LabelScores& one : scores.labels) {
        labels.push_back(json_of(one, sample_ml));
        out.least_dice = std::min(out.least_dice, one.overlap.dice());
        if (!one.surface) {
            out.least_surface_dice = 0.0;
            out.largest_mm = INFINITY;
            continue;
        }
        out.least_surface_dice = std::min(out.least_surface_dice, one.surface->dice);
        out.largest_mm = std::max(out.largest_mm, one.surface->largest_mm.value_or(INFINITY));
    }
    out.json = Json{{"tolerance_mm", options.tolerance_mm},
                    {"box_margin_mm", options.box_margin_mm},
                    {"least_dice", out.least_dice},
                    {"overall", json_of(scores.overall, sample_ml)},
                    {"labels", std::move(labels)}};
    if (runs.empty())
        return out;
    std::vector<Volume> all{first, truth};
    all.insert(all.end(), runs.begin(), runs.end());
    PALPATE_TRY(const std::vector<RunsAgreement> agreement, runs_agreement(all));
    Json precision = Json::array();
    for (const RunsAgreement& one : agreement)
        precision.push_back(json_of(one));
    out.json["runs"] = std::move(precision);
    return out;
}

Json enclosed_volumes(const Mesh& first, const MeshTopology& of_first, const Mesh& second,
                      const MeshTopology& of_second) {
    const std::optional<LabelFigures> a = figures_of_labels(first), b = figures_of_labels(second);
    Json json{{"volume_mm3", {volume_of(of_first, a), volume_of(of_second, b)}}};
    if (a && b)
        json["labels"] = json_of(*a, *b);
    return json;
}

} // namespace palpate
