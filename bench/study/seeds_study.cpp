#include "bench/study/seeds_study.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

#include "bench/study/samples.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/base/timer.h"
#include "engine/segment/draw.h"
#include "engine/segment/grow_heights.h"
#include "engine/segment/methods.h"
#include "engine/segment/seed_forest.h"
#include "engine/segment/simulated_seeds.h"
#include "engine/volume/builder.h"
#include "engine/volume/grid.h"

namespace palpate::bench {

namespace {

constexpr uint16_t kOutside = 65535;

double middle_of(std::vector<double> all) {
    if (all.empty())
        return 0.0;
    std::ranges::sort(all);
    return all[all.size() / 2];
}

double mean_of(const std::vector<double>& all) {
    double sum = 0.0;
    for (const double one : all)
        sum += one / double(all.size());
    return sum;
}

double least_of(const std::vector<double>& all) {
    return all.empty() ? 0.0 : *std::ranges::min_element(all);
}

double cpu_s() {
    return double(std::clock()) / CLOCKS_PER_SEC; // of all threads
}

// The labels of a case, and kOutside elsewhere.
Volume chosen(const SeedsCase& one) {
    std::vector<bool> is_chosen(65536);
    for (const uint16_t label : one.labels)
        is_chosen[label] = true;
    return make_volume(one.truth.grid(), ScalarType::u16, [&](glm::uvec3 i) {
        const auto label = size_t(one.truth.value(i));
        return is_chosen[label] ? double(label) : double(kOutside);
    });
}

Result<std::vector<SeedBall>> balls_of(const SeedsCase& one, const Volume& truth,
                                       const SeedsOptions& options, uint64_t user,
                                       const Task& task) {
    std::vector<SeedBall> balls;
    std::vector<uint16_t> labels = one.labels;
    labels.push_back(kOutside);
    for (const uint16_t label : labels) {
        SimulatedSeedOptions how{.label = label, .radius_mm = one.radius_mm};
        how.count = label == kOutside ? options.outside : options.balls;
        how.random = user;
        PALPATE_TRY(const SeedFile file, simulated_seeds(truth, how, {task.stop, {}}));
        balls.insert(balls.end(), file.balls.begin(), file.balls.end());
    }
    return balls;
}

Result<void> save(const Volume& volume, const std::filesystem::path& path) {
    const std::vector<float> samples = samples_of(volume);
    return save_bytes(path, std::as_bytes(std::span(samples)));
}

// Files for programs that are asked beside ours: floats, x fastest.
Result<void> keep(const std::filesystem::path& folder, const SeedsCase& one, const Volume& truth,
                  const Volume& seeds, uint64_t user) {
    const std::string name = fmt::format("{} {}", one.name, user);
    const glm::uvec3 size = one.volume.size();
    const glm::dvec3 spacing = spacing_mm(one.volume.grid());
    const Json about{{"case", one.name},
                     {"size", {size.x, size.y, size.z}},
                     {"spacing_mm", {spacing.x, spacing.y, spacing.z}},
                     {"outside", kOutside}};
    const std::string text = json_text(about);
    PALPATE_TRY(save_bytes(folder / (name + ".json"), std::as_bytes(std::span(text))));
    PALPATE_TRY(save(one.volume, folder / (name + ".volume")));
    PALPATE_TRY(save(truth, folder / (name + ".truth")));
    return save(seeds, folder / (name + ".seeds"));
}

struct Score {
    double mean = 0.0, worst = 1.0;
};
Score dice_of(const Volume& made, const SeedsCase& one) {
    const std::vector<float> found = samples_of(made), truth = samples_of(one.truth);
    Score score;
    for (const uint16_t label : one.labels) {
        double both = 0.0, first = 0.0, second = 0.0;
        for (size_t i = 0; i < truth.size(); ++i) {
            const bool a = found[i] == float(label), b = truth[i] == float(label);
            both += a && b, first += a, second += b;
        }
        const double dice = 2.0 * both / std::max(first + second, 1.0);
        score.mean += dice / double(one.labels.size());
        score.worst = std::min(score.worst, dice);
    }
    return score;
}

struct Figures {
    std::vector<double> wall, cpu, mean, worst;
    int stopped = 0;

    Json json() const {
        Json row{{"wall_s", middle_of(wall)}, {"cpu_s", middle_of(cpu)}, {"stopped", stopped}};
        row["dice"] = {{"mean", mean_of(mean)}, {"worst", least_of(worst)}};
        return row;
    }
};

// Asks for a stop once a task has taken too long, at its next sign of progress.
class Limit {
 public:
    Limit(const Task& task, double longest_s) : outer_(task), end_s_(cpu_s() + longest_s) {}
    Task task() {
        return {source_.get_token(), [this](double) {
                    if (cpu_s() > end_s_ || outer_.stop.stop_requested())
                        source_.request_stop();
                }};
    }
    bool is_over() const { return source_.stop_requested(); }

 private:
    Task outer_;
    double end_s_;
    std::stop_source source_;
};

Result<void> add_run(const SeedsCase& one, const SegmentMethod& method, const SegmentInput& input,
                     double longest_s, const Task& task, Figures& figures) {
    Limit limit(task, longest_s);
    const Timer timer;
    const double cpu = cpu_s();
    const Result<Segmented> made = segment(method, input, {}, limit.task());
    const double wall_s = timer.ms() / 1000.0, used_s = cpu_s() - cpu;
    if (task.stop.stop_requested())
        return fail("interrupted at {}", method.name);
    if (!made && limit.is_over()) {
        ++figures.stopped;
        return {};
    }
    if (!made)
        return fail("{}: {}: {}", one.name, method.name, made.error().message);
    const Score score = dice_of(made->labels, one);
    figures.wall.push_back(wall_s);
    figures.cpu.push_back(used_s);
    figures.mean.push_back(score.mean);
    figures.worst.push_back(score.worst);
    return {};
}

// Wall clock and the time of all processors.
Json timed(const auto& work) {
    const Timer timer;
    const double cpu = cpu_s();
    work();
    return {{"wall_s", timer.ms() / 1000.0}, {"cpu_s", cpu_s() - cpu}};
}

double most_memory_mib() {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    return double(used.ru_maxrss) / 1024.0;
}

} // namespace

Result<Json> seeds_study(const SeedsOptions& options, const Task& task) {
    Json json{{"rows", Json::array()}};
    for (const SeedsCase& one : options.cases) {
        const Volume truth = chosen(one);
        std::vector<SegmentInput> inputs;
        for (uint64_t user = 0; user < options.users; ++user) {
            PALPATE_TRY(std::vector<SeedBall> balls,
                        balls_of(one, truth, options, options.first_user + user, task));
            PALPATE_TRY(Volume seeds, seed_map(one.volume, balls));
            if (!options.keep.empty()) {
                PALPATE_TRY(keep(options.keep, one, truth, seeds, user));
            }
            inputs.push_back({one.volume, std::move(seeds), std::move(balls), kOutside});
        }
        for (const std::string& name : options.methods) {
            Figures figures;
            for (const SegmentInput& input : inputs)
                PALPATE_TRY(add_run(one, *find_segment_method(name), input, options.longest_s, task,
                                    figures));
            Json row = figures.json();
            row["case"] = one.name, row["method"] = name;
            log::info(
                "{}: {}: Dice {:.3f}, worst {:.3f}; {:.2f} s, {:.2f} s of processors, {} stopped",
                one.name, name, mean_of(figures.mean), least_of(figures.worst),
                middle_of(figures.wall), middle_of(figures.cpu), figures.stopped);
            json["rows"].push_back(std::move(row));
        }
    }
    return json;
}

Result<Json> seeds_times(bool with_largest, const Task& task) {
    struct Size {
        glm::uvec3 samples;
        uint16_t labels;
    };
    std::vector<Size> sizes{{{202, 202, 179}, 5}};
    if (with_largest)
        sizes.push_back({{400, 400, 1500}, 20});
    Json rows = Json::array();
    for (const Size& size : sizes) {
        const Grid grid = make_grid(size.samples, {0.8, 0.8, 1.0});
        // Smooth waves of 40 samples, and noise of a tenth of them.
        const Volume volume = make_volume(grid, ScalarType::i16, [](glm::uvec3 i) {
            const glm::dvec3 at = glm::dvec3(i) * 0.157;
            uint32_t hash = i.x * 73856093u ^ i.y * 19349663u ^ i.z * 83492791u;
            hash = (hash ^ hash >> 13) * 1274126177u;
            return 500.0 * (std::sin(at.x) + std::sin(at.y) + std::sin(at.z)) +
                   double((hash ^ hash >> 16) % 100);
        });
        Draw draw(9);
        std::vector<SeedBall> balls;
        const auto add_ball = [&](uint16_t label) {
            const glm::dvec3 at = glm::dvec3(draw.between(0.05, 0.95), draw.between(0.05, 0.95),
                                             draw.between(0.05, 0.95)) *
                                  glm::dvec3(size.samples);
            balls.push_back({label, world_point(grid, at), 6.0});
        };
        for (uint16_t label = 1; label <= size.labels; ++label)
            for (int n = 0; n < 5; ++n)
                add_ball(label);
        const Volume seeds = *seed_map(volume, balls);
        add_ball(1);
        const Volume more = *seed_map(volume, balls);
        const double before_mib = most_memory_mib();
        std::vector<uint16_t> heights;
        Json row{{"samples", size.samples.x * uint64_t{size.samples.y} * size.samples.z},
                 {"labels", size.labels}};
        row["heights"] = timed([&] { heights = *grow_heights(volume, nullptr, task); });
        SeedForest forest(grid, std::move(heights), 5.0 * glm::length(glm::dvec3(size.samples)));
        row["forest"] = timed([&] { (void)forest.update(seeds, task); });
        row["served"] = forest.served();
        std::optional<Volume> labels;
        row["to_volume"] = timed([&] { labels = *forest.labels(ScalarType::u8, 0, task); });
        row["ball_more"] = timed([&] { (void)forest.update(more, task); });
        row["ball_more_served"] = forest.served();
        row["ball_less"] = timed([&] { (void)forest.update(seeds, task); });
        row["ball_less_served"] = forest.served();
        row["held_bytes_a_sample"] = double(forest.bytes()) / double(sample_count(grid));
        row["process_more_bytes_a_sample"] =
            (most_memory_mib() - before_mib) * 1048576.0 / double(sample_count(grid));
        if (task.stop.stop_requested())
            return fail("interrupted");
        log::info("{}", json_text(row));
        rows.push_back(std::move(row));
    }
    return rows;
}

} // namespace palpate::bench
