#include "bench/study/liver_study.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bench/study/liver_phantom.h"
#include "bench/study/manual_outline.h"
#include "bench/study/samples.h"
#include "engine/measure/label_scores.h"
#include "engine/mesh/self_intersections.h"
#include "engine/segment/mesh_fit.h"
#include "engine/segment/methods.h"
#include "engine/segment/signed_distance.h"
#include "engine/volume/builder.h"

namespace palpate::bench {

namespace {

constexpr const char* kMarching = "fast-marching";

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const size_t middle = values.size() / 2;
    return values.size() % 2 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

// Figures of one approach over all volumes and users.
struct Tally {
    std::vector<double> dice, sensitivity, specificity, box_specificity, precision;
    std::vector<double> distance_mm, far_mm; // of surfaces: mean, and 95 % are nearer
    std::vector<double> gap;                 // to the best threshold, in Dice
    std::vector<double> clicks, seconds;
    uint32_t unbounded = 0;                       // fronts that met no boundary
    std::optional<uint64_t> self_intersections{}; // of meshes

    Result<void> add(const Volume& result, const Volume& truth, const Interaction& interaction,
                     const Task& task) {
        PALPATE_TRY(const LabelMapScores scores, label_scores(result, truth, {}, task));
        const OverlapScores& overlap = scores.overall.overlap;
        dice.push_back(overlap.dice());
        sensitivity.push_back(overlap.sensitivity().value_or(0.0));
        specificity.push_back(overlap.specificity().value_or(0.0));
        box_specificity.push_back(overlap.box_specificity().value_or(0.0));
        if (const auto& surface = scores.overall.surface; surface && surface->mean_mm) {
            distance_mm.push_back(*surface->mean_mm);
            far_mm.push_back(*surface->p95_mm);
        }
        clicks.push_back(interaction.clicks);
        seconds.push_back(interaction.seconds());
        return {};
    }
    void add_cuts(uint64_t pairs) { self_intersections = self_intersections.value_or(0) + pairs; }
    // Every pair of the results that users have made of one volume.
    Result<void> add_pairs(const std::vector<Volume>& results) {
        for (size_t a = 0; a < results.size(); ++a)
            for (size_t b = 0; b < a; ++b) {
                PALPATE_TRY(const std::vector<RunsAgreement> both,
                            runs_agreement({results[a], results[b]}));
                precision.push_back(both.empty() ? 1.0 : both.front().jaccard_mean);
            }
        return {};
    }

    Json json() const {
        const auto figures = [](const std::vector<double>& values) {
            return values.empty()
                       ? Json()
                       : Json{{"median", median(values)},
                              {"mean", mean(values)},
                              {"worst", *std::min_element(values.begin(), values.end())}};
        };
        Json json{{"results", dice.size()},
                  {"dice", figures(dice)},
                  {"sensitivity", figures(sensitivity)},
                  {"specificity", figures(specificity)},
                  {"box_specificity", figures(box_specificity)}};
        if (!precision.empty()) {
            double squares = 0.0;
            for (const double p : precision)
                squares += (p - mean(precision)) * (p - mean(precision));
            const double sd = std::sqrt(squares / std::max(1.0, double(precision.size()) - 1.0));
            json["precision"] = {{"mean", mean(precision)},
                                 {"cv", sd / mean(precision)},
                                 {"least", *std::min_element(precision.begin(), precision.end())},
                                 {"pairs", precision.size()}};
        }
        const auto distances = [](const std::vector<double>& mm) {
            return mm.empty() ? Json()
                              : Json{{"median", median(mm)},
                                     {"worst", *std::max_element(mm.begin(), mm.end())}};
        };
        json.update(
            {{"surface_mean_mm", distances(distance_mm)}, {"surface_p95_mm", distances(far_mm)}});
        if (!clicks.empty() && median(clicks) > 0.0)
            json.update({{"clicks", median(clicks)}, {"seconds", median(seconds)}});
        if (self_intersections)
            json["self_intersections"] = *self_intersections;
        if (!gap.empty())
            json["gap"] = {{"median", median(gap)},
                           {"worst", *std::max_element(gap.begin(), gap.end())},
                           {"unbounded", unbounded}};
        return json;
    }

 private:
    static double mean(const std::vector<double>& values) {
        return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
    }
};

// Labels of 0 and 1.
Volume mask_where(const Grid& grid, const std::function<bool(glm::uvec3)>& inside) {
    return make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) { return inside(i) ? 1.0 : 0.0; });
}

double dice_of(const Volume& result, const Volume& truth) {
    const std::vector<float> found = samples_of(result), wanted = samples_of(truth);
    double both = 0.0, sum = 0.0;
    for (size_t i = 0; i < found.size(); ++i) {
        both += found[i] != 0.0f && wanted[i] != 0.0f;
        sum += double(found[i] != 0.0f) + double(wanted[i] != 0.0f);
    }
    return sum > 0.0 ? 2.0 * both / sum : 1.0;
}

// The largest Dice that any threshold of a strength gives; smaller is stronger.
double best_dice(const Volume& strength, const Volume& truth) {
    const std::vector<float> values = samples_of(strength), wanted = samples_of(truth);
    std::vector<std::pair<float, bool>> samples;
    double total = 0.0;
    for (size_t i = 0; i < values.size(); ++i) {
        total += wanted[i] != 0.0f;
        if (!std::isnan(values[i]))
            samples.emplace_back(values[i], wanted[i] != 0.0f);
    }
    std::sort(samples.begin(), samples.end());
    double both = 0.0, best = 0.0;
    for (size_t i = 0; i < samples.size(); ++i) {
        both += samples[i].second;
        if (i + 1 == samples.size() || samples[i + 1].first != samples[i].first)
            best = std::max(best, 2.0 * both / (double(i + 1) + total));
    }
    return best;
}

// A front that meets no boundary gives its seeds, and sets `unbounded`.
Result<Segmented> segmented(const char* method, const Volume& volume,
                            std::span<const SeedBall> balls, uint16_t background, bool& unbounded,
                            const Task& task) {
    std::vector<SeedBall> usable; // a mistake may lie beyond the volume
    for (const SeedBall& ball : balls)
        if (seed_map(volume, std::span(&ball, 1)))
            usable.push_back(ball);
    PALPATE_TRY(const Volume seeds, seed_map(volume, usable));
    const SegmentMethod& chosen = *find_segment_method(method);
    const SegmentInput input{volume, seeds, usable, background};
    Result<Segmented> found = segment(chosen, input, {}, task);
    unbounded = !found && !task.stop.stop_requested() && std::string_view(method) == kMarching;
    return unbounded ? segment(chosen, input, {{"threshold", 0.0}}, task) : found;
}

struct Case {
    std::string name;
    const Volume& volume;
    const Volume& truth;
    uint64_t number;
};

uint64_t seed_of(const Case& one, uint32_t user) {
    return 1000003 * one.number + 17 * user + 3;
}

// A patch of a mesh that a person holds where it was drawn to.
struct Held {
    SimplexPull pull;
    glm::dvec3 to_mm;
};

glm::dvec3 center_of(const SimplexMesh& mesh, const std::vector<uint32_t>& faces) {
    glm::dvec3 sum(0.0);
    double count = 0.0;
    for (const uint32_t f : faces)
        for (uint32_t i = mesh.face_first[f]; i < mesh.face_first[f + 1]; ++i, ++count)
            sum += mesh.positions[mesh.face_vertices[i]];
    return sum / count;
}

// The mesh is let go on while patches are held by springs.
constexpr int kStepsOfPull = 60;
constexpr double kSpring = 0.2;

void draw_mesh(SimplexMesh& mesh, const SimplexForce& force, std::vector<Held>& held,
               const SimplexOptions& options) {
    for (int step = 0; step < kStepsOfPull; ++step) {
        std::vector<SimplexPull> pulls;
        for (Held& one : held) {
            one.pull.by_mm = kSpring * (one.to_mm - center_of(mesh, one.pull.faces));
            pulls.push_back(one.pull);
        }
        simplex_step(mesh, force, pulls, options);
    }
}

Held hold(const SimplexMesh& mesh, const MeshPull& pull) {
    const uint32_t first = mesh.face_vertices[mesh.face_first[pull.face]];
    const double edge_mm =
        glm::distance(mesh.positions[first], mesh.positions[mesh.neighbours[first].x]);
    // Faces are hexagons, two heights of a triangle apart.
    const auto depth = uint32_t(std::clamp(pull.wide_mm / (std::sqrt(3.0) * edge_mm), 1.0, 12.0));
    Held held{{patch_of_faces(mesh, pull.face, depth), glm::dvec3(0.0)}, {}};
    held.to_mm = center_of(mesh, held.pull.faces) + pull.by_mm * pull.direction;
    return held;
}

// Figures of the three approaches that begin with seeds.
struct Seeded {
    Tally marching, mesh, pulled;

    Result<void> add(const Case& one, const StudyOptions& options, const Task& task) {
        std::vector<Volume> of_marching, of_mesh, of_pulled;
        PALPATE_TRY(const Volume wanted, signed_distance(one.truth, {}, task));
        for (uint32_t u = 0; u < options.users; ++u) {
            SimulatedUser user(seed_of(one, u), {});
            PALPATE_TRY(const std::vector<SeedBall> balls,
                        user.seeds(one.truth, options.seeds, task));
            bool unbounded = false;
            PALPATE_TRY(const Segmented found,
                        segmented(kMarching, one.volume, balls, 0, unbounded, task));
            marching.unbounded += unbounded;
            PALPATE_TRY(marching.add(found.labels, one.truth, user.interaction(), task));
            marching.gap.push_back(best_dice(*found.strength, one.truth) - marching.dice.back());
            of_marching.push_back(found.labels);

            const MeshFitOptions how;
            PALPATE_TRY(MeshFit fit, fit_mesh(one.volume, found.labels, how, task));
            mesh.add_cuts(fit.self_intersections);
            PALPATE_TRY(mesh.add(fit.labels, one.truth, user.interaction(), task));
            of_mesh.push_back(fit.labels);

            if (options.pulls == 0)
                continue;
            PALPATE_TRY(const Volume distance, signed_distance(found.labels, {}, task));
            const SimplexForce force = toward_surface(distance);
            std::vector<Held> held;
            while (held.size() < options.pulls) {
                const std::optional<MeshPull> pull = user.pull(fit.mesh, wanted);
                if (!pull)
                    break;
                held.push_back(hold(fit.mesh, *pull));
                draw_mesh(fit.mesh, force, held, how.simplex);
            }
            pulled.add_cuts(self_intersections(triangles_of(fit.mesh)).size());
            PALPATE_TRY(Volume labels, rasterised(fit.mesh, one.truth.grid(), 1, task));
            PALPATE_TRY(pulled.add(labels, one.truth, user.interaction(), task));
            of_pulled.push_back(std::move(labels));
        }
        PALPATE_TRY(marching.add_pairs(of_marching));
        PALPATE_TRY(mesh.add_pairs(of_mesh));
        return pulled.add_pairs(of_pulled);
    }
};

Result<void> by_hand(const Case& one, Tally& tally, const Task& task) {
    std::vector<Volume> results;
    for (uint32_t u = 0; u < 2; ++u) {
        PALPATE_TRY(Outlined drawn, outline_by_hand(one.truth, seed_of(one, 100 + u), {}, task));
        PALPATE_TRY(tally.add(drawn.labels, one.truth, drawn.interaction, task));
        results.push_back(std::move(drawn.labels));
    }
    return tally.add_pairs(results);
}

struct Controls {
    Tally nothing, everything, eroded, dilated;

    Result<void> add(const Case& one, const Task& task) {
        const Grid& grid = one.truth.grid();
        // A sample in the slice: what lies within one of the boundary goes, or comes.
        const glm::dvec3 spacing = spacing_mm(grid);
        const double voxel_mm = 1.001 * std::max({spacing.x, spacing.y, spacing.z});
        PALPATE_TRY(const Volume distance, signed_distance(one.truth, {}, task));
        const auto add_one = [&](Tally& tally, const std::function<bool(glm::uvec3)>& inside) {
            return tally.add(mask_where(grid, inside), one.truth, {}, task);
        };
        PALPATE_TRY(add_one(nothing, [](glm::uvec3) { return false; }));
        PALPATE_TRY(add_one(everything, [](glm::uvec3) { return true; }));
        PALPATE_TRY(add_one(eroded, [&](glm::uvec3 i) { return distance.value(i) < -voxel_mm; }));
        return add_one(dilated, [&](glm::uvec3 i) { return distance.value(i) <= voxel_mm; });
    }
};

// Dice after each click of a user who begins with one seed and then corrects the largest error, by
// a seed inside or outside.
Result<std::vector<double>> curve(const char* method, const Case& one, uint32_t clicks,
                                  const Task& task) {
    constexpr uint16_t kOutside = 2;
    SimulatedUser user(seed_of(one, 200), {});
    PALPATE_TRY(std::vector<SeedBall> balls, user.seeds(one.truth, 1, task));
    std::vector<double> dice;
    bool unbounded = false;
    while (true) {
        const bool has_outside =
            std::ranges::any_of(balls, [](const SeedBall& ball) { return ball.label == kOutside; });
        PALPATE_TRY(const Segmented found, segmented(method, one.volume, balls,
                                                     has_outside ? kOutside : 0, unbounded, task));
        dice.push_back(dice_of(found.labels, one.truth));
        if (dice.size() == clicks)
            return dice;
        PALPATE_TRY(const auto correction, user.correct(one.truth, found.labels, task));
        if (!correction) {
            dice.resize(clicks, dice.back());
            return dice;
        }
        balls.push_back(correction->ball);
        balls.back().label = correction->add ? 1 : kOutside;
    }
}

Json print_of(double precision, double cv) {
    return {{"precision", precision}, {"cv", cv}};
}

} // namespace

Result<Json> liver_study(const StudyOptions& options, const Task& task) {
    Tally hand;
    Seeded seeded;
    Controls controls;
    const char* const methods[] = {kMarching, "region-growing", "watershed", "fuzzy-connectedness"};
    std::vector<std::vector<double>> curves(std::size(methods),
                                            std::vector<double>(options.clicks));
    const double parts = double(options.phantoms + options.organs.size());
    for (uint32_t i = 0; i < options.phantoms; ++i) {
        const Task part{task.stop, {}};
        const LiverPhantom phantom = liver_phantom(i);
        const Case one{fmt::format("phantom {}", i), phantom.volume, phantom.truth, i};
        PALPATE_TRY(seeded.add(one, options, part));
        PALPATE_TRY(controls.add(one, part));
        if (i < options.outlined)
            PALPATE_TRY(by_hand(one, hand, part));
        for (size_t m = 0; i < options.curves && m < std::size(methods); ++m) {
            PALPATE_TRY(const std::vector<double> dice,
                        curve(methods[m], one, options.clicks, part));
            for (size_t c = 0; c < dice.size(); ++c)
                curves[m][c] += dice[c] / std::min(options.curves, options.phantoms);
        }
        if (task.progress)
            task.progress((i + 1) / parts);
    }

    Json json;
    const auto add_row = [&](const char* name, const Tally& tally, Json print) {
        if (tally.dice.empty())
            return;
        Json row{{"name", name}};
        row.update(tally.json());
        row["print"] = std::move(print);
        json["rows"].push_back(std::move(row));
    };
    Json print = print_of(0.889, 0.019);
    print.update({{"seconds", "5 to 18 minutes"}});
    add_row("outlined by hand", hand, print);
    print = print_of(0.969, 0.038);
    print.update({{"sensitivity", 0.93}, {"specificity", "close to 1"}, {"seconds", 40}});
    add_row("fast marching", seeded.marching, print);
    print = print_of(0.978, 0.005);
    print.update({{"sensitivity", 0.96}, {"specificity", "close to 1"}, {"seconds", 133}});
    add_row("mesh about it", seeded.mesh, {});
    add_row("mesh pulled by hand", seeded.pulled, print);
    add_row("control: nothing", controls.nothing, {});
    add_row("control: everything", controls.everything, {});
    add_row("control: truth eroded by a sample", controls.eroded, {});
    add_row("control: truth dilated by a sample", controls.dilated, {});
    for (size_t m = 0; options.curves > 0 && m < std::size(methods); ++m)
        json["curves"].push_back(Json{{"method", methods[m]}, {"dice", curves[m]}});

    for (size_t o = 0; o < options.organs.size(); ++o) {
        const StudyOrgan& organ = options.organs[o];
        Seeded tally;
        StudyOptions without_pulls = options;
        without_pulls.pulls = 0;
        PALPATE_TRY(tally.add({organ.name, organ.volume, organ.truth, 5000 + o}, without_pulls,
                              {task.stop, {}}));
        Json row{{"name", organ.name}, {"held_out", organ.held_out}};
        row.update(tally.marching.json());
        row["mesh"] = tally.mesh.json();
        json["organs"].push_back(std::move(row));
        if (task.progress)
            task.progress((options.phantoms + double(o) + 1.0) / parts);
    }
    return json;
}

} // namespace palpate::bench
