#include "engine/segment/smooth_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <numeric>
#include <optional>

#include "engine/segment/label_samples.h"

namespace palpate {

namespace {

constexpr double kMostSamples = 8.0; // sigma
constexpr double kCut = 3.0;         // sigmas

using Kernel = std::vector<float>; // weights of offsets 0, 1, ..

Kernel kernel_of(double sigma) {
    Kernel weights;
    double sum = 0.0;
    for (int i = 0; i <= int(std::ceil(kCut * sigma)); ++i) {
        const double w = std::exp(-0.5 * (i / sigma) * (i / sigma));
        weights.push_back(float(w));
        sum += i == 0 ? w : 2.0 * w;
    }
    for (float& w : weights)
        w = float(double{w} / sum);
    return weights;
}

// One axis of a box: out has `count` places along it, each from 2 radius + 1 of `in`.
// before, after: places on the axes that vary faster and slower.
void convolve(const std::vector<float>& in, std::vector<float>& out, size_t before, size_t count,
              size_t after, const Kernel& kernel) {
    const size_t radius = kernel.size() - 1;
    out.assign(before * count * after, 0.0f);
    for (size_t a = 0; a < after; ++a)
        for (size_t i = 0; i < count; ++i) {
            float* to = out.data() + (a * count + i) * before;
            const float* from = in.data() + (a * (count + 2 * radius) + i + radius) * before;
            for (size_t b = 0; b < before; ++b)
                to[b] = kernel[0] * from[b];
            for (size_t k = 1; k <= radius; ++k)
                for (size_t b = 0; b < before; ++b)
                    to[b] += kernel[k] *
                             (from[ptrdiff_t(b) - ptrdiff_t(k * before)] + from[b + k * before]);
        }
}

// How clearly a sample has its label: margins of the largest indicator over the second, by both
// labels, in steps of 1 / kSteps.
constexpr size_t kSteps = 1024;
constexpr double kMostLift = 0.45; // of a label against the background; of two, twice that: below 1
constexpr size_t kMargins = size_t(2.0 * kMostLift * double(kSteps));
struct Survey {
    std::map<uint16_t, uint64_t> before, after; // samples of each label
    std::map<std::pair<uint16_t, uint16_t>, std::vector<uint64_t>> margins;

    void add(const Survey& other) {
        for (const auto& [label, count] : other.before)
            before[label] += count;
        for (const auto& [label, count] : other.after)
            after[label] += count;
        for (const auto& [pair, counts] : other.margins) {
            std::vector<uint64_t>& to = margins[pair];
            to.resize(kMargins);
            for (size_t i = 0; i < kMargins; ++i)
                to[i] += counts[i];
        }
    }
};

struct Smoother {
    Volume labels;
    std::array<Kernel, 3> kernel;
    std::vector<bool> locked;         // by label
    std::map<uint16_t, float> lift{}; // added to a label's indicator; 0 where none is given

    // The labels with the largest indicator, and the second, of the brick's valid samples, x
    // fastest.
    struct Votes {
        glm::uvec3 valid;
        std::optional<uint16_t> all; // of every sample; then the rest is empty
        std::vector<uint16_t> own, best, second;
        std::vector<float> most, next;
    };
    Votes votes(glm::uvec3 position) const {
        const glm::ivec3 radius(kernel[0].size() - 1, kernel[1].size() - 1, kernel[2].size() - 1);
        Votes out{labels.valid_in_brick(position), {}, {}, {}, {}, {}, {}};
        const glm::uvec3 valid = out.valid;
        const glm::ivec3 first = glm::ivec3(position * kBrickSide) - radius;
        const glm::ivec3 size = glm::ivec3(valid) + 2 * radius;
        std::vector<uint16_t> box(size_t(size.x) * size_t(size.y) * size_t(size.z));
        read_labels(labels, first, size, box.data());
        std::vector<uint16_t> present = box;
        std::sort(present.begin(), present.end());
        present.erase(std::unique(present.begin(), present.end()), present.end());
        if (present.size() == 1) {
            out.all = present[0];
            return out;
        }
        const size_t inside = size_t{valid.x} * valid.y * valid.z;
        std::vector<float> indicator(box.size()), a, b;
        out.most.assign(inside, -1.0f), out.next.assign(inside, -1.0f);
        out.own.resize(inside), out.best.assign(inside, 0), out.second.assign(inside, 0);
        for (size_t i = 0; i < inside; ++i) {
            const glm::ivec3 at(int(i % valid.x), int(i / valid.x % valid.y),
                                int(i / (size_t{valid.x} * valid.y)));
            const glm::ivec3 p = at + radius;
            out.own[i] =
                box[size_t(p.x) + size_t(size.x) * (size_t(p.y) + size_t(size.y) * size_t(p.z))];
            if (locked[out.own[i]])
                out.best[i] = out.own[i];
        }
        for (const uint16_t label : present) {
            if (locked[label])
                continue;
            std::transform(box.begin(), box.end(), indicator.begin(),
                           [&](uint16_t one) { return one == label ? 1.0f : 0.0f; });
            convolve(indicator, a, size_t(size.x) * size_t(size.y), valid.z, 1, kernel[2]);
            convolve(a, b, size_t(size.x), valid.y, valid.z, kernel[1]);
            convolve(b, a, 1, valid.x, size_t{valid.y} * valid.z, kernel[0]);
            const auto lifted = lift.find(label);
            const float more = lifted == lift.end() ? 0.0f : lifted->second;
            for (size_t i = 0; i < inside; ++i) {
                if (!(a[i] > 0.0f) || locked[out.own[i]])
                    continue;
                const float vote = a[i] + more;
                if (vote > out.most[i] || (vote == out.most[i] && out.own[i] == label)) {
                    out.next[i] = out.most[i], out.second[i] = out.best[i];
                    out.most[i] = vote, out.best[i] = label;
                } else if (vote > out.next[i]) {
                    out.next[i] = vote, out.second[i] = label;
                }
            }
        }
        return out;
    }

    Survey survey(glm::uvec3 position) const {
        Survey out;
        const Votes v = votes(position);
        if (v.all) {
            out.before[*v.all] = out.after[*v.all] = size_t{v.valid.x} * v.valid.y * v.valid.z;
            return out;
        }
        for (size_t i = 0; i < v.best.size(); ++i) {
            ++out.before[v.own[i]];
            ++out.after[v.best[i]];
            const auto margin = size_t((v.most[i] - v.next[i]) * float(kSteps));
            if (v.next[i] < -0.5f || margin >= kMargins)
                continue;
            std::vector<uint64_t>& counts = out.margins[{v.best[i], v.second[i]}];
            counts.resize(kMargins);
            ++counts[margin];
        }
        return out;
    }

    BrickPtr brick(glm::uvec3 position) const {
        const Votes v = votes(position);
        if (v.all)
            return make(std::vector<uint16_t>(kBrickSamples, *v.all), v.valid);
        std::vector<uint16_t> out(kBrickSamples, 0);
        for (uint32_t z = 0, i = 0; z < v.valid.z; ++z)
            for (uint32_t y = 0; y < v.valid.y; ++y)
                for (uint32_t x = 0; x < v.valid.x; ++x, ++i)
                    out[offset_in_brick({x, y, z})] = v.best[i];
        return make(out, v.valid);
    }

    BrickPtr make(const std::vector<uint16_t>& samples, glm::uvec3 valid) const {
        return visit_scalar(labels.type(), [&]<class T>(T) -> BrickPtr {
            const std::vector<T> typed(samples.begin(), samples.end());
            return Brick::make(std::span<const T>(typed), valid);
        });
    }
};

Result<Survey> survey_of(const Smoother& smoother, const Task& task) {
    const glm::uvec3 bricks = smoother.labels.brick_count();
    std::mutex mutex; // counts are whole numbers: their order does not matter
    Survey sum;
    const bool all =
        run_all(size_t{bricks.x} * bricks.y * bricks.z, {task.stop, {}}, [&](size_t n) {
            const Survey one = smoother.survey(
                {n % bricks.x, n / bricks.x % bricks.y, n / (size_t{bricks.x} * bricks.y)});
            const std::lock_guard lock(mutex);
            sum.add(one);
        });
    if (!all)
        return stopped();
    return sum;
}

// The growth that each label's lift needs so that all keep their numbers of samples, as far as the
// two labels with the largest indicators decide. One after the other, until none changes.
std::map<uint16_t, double> growth_of_lifts(const Survey& survey,
                                           const std::map<uint16_t, float>& lift) {
    std::map<std::pair<uint16_t, uint16_t>, std::vector<uint64_t>> below = survey.margins;
    std::map<uint16_t, std::vector<std::pair<uint16_t, uint16_t>>> pairs;
    for (auto& [pair, counts] : below) {
        std::partial_sum(counts.begin(), counts.end(), counts.begin());
        pairs[pair.first].push_back(pair);
        pairs[pair.second].push_back(pair);
    }
    std::map<uint16_t, double> by;
    // Samples that the second label takes from the first where its lift grows by so much more.
    const auto taken = [&](std::pair<uint16_t, uint16_t> pair, double more) {
        const double step = std::min(more * double(kSteps), double(kMargins) - 0.5);
        return step >= 1.0 ? double(below.find(pair)->second[size_t(step) - 1]) : 0.0;
    };
    const auto count = [&](uint16_t label, double own) {
        double sum = 0.0;
        if (const auto after = survey.after.find(label); after != survey.after.end())
            sum += double(after->second);
        for (const auto& pair : pairs[label]) {
            const bool wins = pair.first == label;
            const double other = by[wins ? pair.second : pair.first];
            sum += wins ? -taken(pair, other - own) : taken(pair, own - other);
        }
        return sum;
    };
    for (int sweep = 0; sweep < 30; ++sweep) {
        double most = 0.0;
        for (const auto& [label, wanted] : survey.before) {
            if (label == 0)
                continue;
            const auto now = lift.find(label);
            const double had = now == lift.end() ? 0.0 : double{now->second};
            double low = -kMostLift - had, high = kMostLift - had;
            for (int i = 0; i < 12; ++i) { // to a quarter of a step
                const double middle = 0.5 * (low + high);
                (count(label, middle) < double(wanted) ? low : high) = middle;
            }
            const auto off = [&](double at) { return std::abs(count(label, at) - double(wanted)); };
            const double found = off(low) < off(high) ? low : high;
            if (off(by[label]) <= off(found))
                continue;
            most = std::max(most, std::abs(found - by[label]));
            by[label] = found;
        }
        if (most == 0.0)
            break;
    }
    return by;
}

// Lifts with which every label keeps its number of samples to kOff, or those that come nearest.
Result<void> keep_volumes(Smoother& smoother, const Task& task) {
    constexpr int kRounds = 4;
    constexpr double kOff = 0.001;
    std::map<uint16_t, float> best;
    double least = INFINITY;
    for (int round = 0; round < kRounds; ++round) {
        PALPATE_TRY(const Survey survey, survey_of(smoother, task));
        double most = 0.0, sum = 0.0; // of what labels are off by
        for (const auto& [label, wanted] : survey.before) {
            const auto after = survey.after.find(label);
            const double has = after == survey.after.end() ? 0.0 : double(after->second);
            const double off = std::abs(has - double(wanted));
            most = std::max(most, off < 1.5 ? 0.0 : off / double(wanted));
            sum += off / double(wanted);
        }
        if (sum < least)
            least = sum, best = smoother.lift;
        if (most <= kOff || round + 1 == kRounds)
            break;
        for (const auto& [label, by] : growth_of_lifts(survey, smoother.lift))
            if (label != 0)
                smoother.lift[label] += float(by);
    }
    smoother.lift = std::move(best);
    return {};
}

} // namespace

Result<BrickMaker> smooth_labels_bricks(const Volume& labels, const SmoothLabelsOptions& options,
                                        const Task& task) {
    PALPATE_TRY(check_labels(labels, "smoothing of labels"));
    const glm::dvec3 sigma = options.sigma_mm / spacing_mm(labels.grid());
    const double most = std::max({sigma.x, sigma.y, sigma.z});
    if (!(options.sigma_mm > 0.0) || most > kMostSamples)
        return fail(
            "smoothing of labels: expected a sigma above 0 and at most {:g} mm here, found "
            "{:g}",
            kMostSamples * options.sigma_mm / (most > 0.0 ? most : 1.0), options.sigma_mm);
    Smoother smoother{labels,
                      {kernel_of(sigma.x), kernel_of(sigma.y), kernel_of(sigma.z)},
                      std::vector<bool>(65536)};
    for (const uint16_t label : options.locked)
        smoother.locked[label] = label != 0;
    if (options.keeps_volumes)
        PALPATE_TRY(keep_volumes(smoother, task));
    return BrickMaker{labels.grid(), labels.type(),
                      [smoother](glm::uvec3 position) { return smoother.brick(position); }};
}

Result<Volume> smooth_labels(const Volume& labels, const SmoothLabelsOptions& options,
                             const Task& task) {
    PALPATE_TRY(const BrickMaker maker, smooth_labels_bricks(labels, options, task));
    return make_bricks(maker, task);
}

} // namespace palpate
