#include "engine/segment/components.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "engine/base/assert.h"
#include "engine/segment/label_bounds.h"
#include "engine/segment/label_samples.h"
#include "engine/segment/rows.h"
#include "engine/segment/runs.h"

namespace palpate {

namespace {

// Samples of each component, by its root.
std::vector<uint64_t> counts_of(const LabelRuns& found) {
    std::vector<uint64_t> counts(found.runs().size(), 0);
    for (size_t i = 0; i < counts.size(); ++i)
        counts[found.roots()[i]] += found.runs()[i].end - found.runs()[i].begin;
    return counts;
}

double ml_of_sample(const Grid& grid) {
    return std::abs(glm::determinant(glm::dmat3(grid.world_from_index))) / 1000.0;
}

// The map, as `type`, with other labels in some runs: of run i, `label(i)`.
template <class Label>
Result<Volume> relabelled(const Volume& labels, const LabelRuns& found, const Label& label,
                          ScalarType type, const Task& task) {
    return visit_scalar(type, [&]<class T>(T) {
        return make_rows<T>(labels.grid(), task, [&](uint32_t y, uint32_t z, std::span<T> row) {
            std::vector<uint16_t> before(row.size());
            read_labels(labels, {0, y, z}, {int(row.size()), 1, 1}, before.data());
            std::copy(before.begin(), before.end(), row.begin());
            const auto [first, last] = found.row(y, z);
            for (uint32_t i = first; i < last; ++i)
                std::fill(row.begin() + found.runs()[i].begin, row.begin() + found.runs()[i].end,
                          T(label(i)));
        });
    });
}

// Which pieces of background are enclosed, and the faces that they share with each label.
class Holes {
 public:
    Holes(const Volume& labels, const LabelRuns& found)
        : labels_(labels), found_(found), open_(found.runs().size(), false) {
        const glm::uvec3 size = labels.size();
        std::vector<uint16_t> planes[2];
        for (uint32_t z = 0; z < size.z; ++z) {
            std::swap(planes[0], planes[1]);
            planes[1].resize(size_t{size.x} * size.y);
            read_labels(labels, {0, 0, int(z)}, {int(size.x), int(size.y), 1}, planes[1].data());
            for (uint32_t y = 0; y < size.y; ++y) {
                const uint16_t* row = planes[1].data() + size_t{y} * size.x;
                const bool at_border = z == 0 || z + 1 == size.z || y == 0 || y + 1 == size.y;
                count_row(row, y, z, at_border, y > 0 ? row - size.x : nullptr,
                          z > 0 ? planes[0].data() + size_t{y} * size.x : nullptr);
            }
        }
    }
    // The label that fills run i; 0: it is left.
    uint16_t filling(uint32_t i, std::optional<uint16_t> label) const {
        const uint32_t root = found_.roots()[i];
        const auto at = faces_.find(root);
        if (open_[root] || at == faces_.end())
            return 0;
        if (label)
            return at->second.size() == 1 && at->second.begin()->first == *label ? *label : 0;
        uint16_t best = 0;
        uint64_t most = 0;
        for (const auto& [one, faces] : at->second)
            if (faces > most) {
                best = one;
                most = faces;
            }
        return best;
    }

 private:
    // Faces of one row within it, and to the rows before.
    void count_row(const uint16_t* row, uint32_t y, uint32_t z, bool at_border,
                   const uint16_t* below, const uint16_t* behind) {
        const uint32_t width = labels_.size().x;
        const auto [first, last] = found_.row(y, z);
        for (uint32_t i = first; i < last; ++i) {
            const LabelRun& run = found_.runs()[i];
            const uint32_t root = found_.roots()[i];
            if (at_border || run.begin == 0 || run.end == width)
                open_[root] = true;
            if (run.begin > 0)
                ++faces_[root][row[run.begin - 1]];
            if (run.end < width)
                ++faces_[root][row[run.end]];
            for (const uint16_t* other : {below, behind})
                for (uint32_t x = run.begin; other && x < run.end; ++x)
                    if (other[x] != 0)
                        ++faces_[root][other[x]];
        }
        // The same faces seen from the rows before.
        for (const bool up : {false, true}) {
            if (up ? z == 0 : y == 0)
                continue;
            const auto [from, to] = up ? found_.row(y, z - 1) : found_.row(y - 1, z);
            for (uint32_t i = from; i < to; ++i)
                for (uint32_t x = found_.runs()[i].begin; x < found_.runs()[i].end; ++x)
                    if (row[x] != 0)
                        ++faces_[found_.roots()[i]][row[x]];
        }
    }

    const Volume& labels_;
    const LabelRuns& found_;
    std::vector<bool> open_;                                 // by root: reaches the border
    std::map<uint32_t, std::map<uint16_t, uint64_t>> faces_; // by root, then by label
};

} // namespace

Result<Components> connected_components(const Volume& labels, const ComponentsOptions& options,
                                        const Task& task) {
    PALPATE_TRY(check_labels(labels, "components"));
    const auto kind = [&](uint16_t label) -> uint16_t {
        if (options.label)
            return label == *options.label;
        return options.as_mask ? uint16_t(label != 0) : label;
    };
    LabelRuns found;
    if (!found.find(labels, kind, options.neighbours, task.part(0.0, 0.8)))
        return stopped();
    const std::vector<uint64_t> counts = counts_of(found);
    std::vector<uint32_t> roots;
    for (uint32_t i = 0; i < counts.size(); ++i)
        if (counts[i] > 0 && counts[i] >= options.least_count)
            roots.push_back(i);
    std::stable_sort(roots.begin(), roots.end(),
                     [&](uint32_t a, uint32_t b) { return counts[a] > counts[b]; });
    if (roots.size() > 65535)
        return fail(
            "components: expected at most 65535, found {}: leave out those of fewer than "
            "{} samples",
            roots.size(), counts[roots[65535]] + 1);
    std::vector<uint16_t> number(counts.size(), 0);
    std::vector<Component> list;
    for (const uint32_t root : roots) {
        list.push_back({found.runs()[root].label, counts[root], found.first_sample(root)});
        number[root] = uint16_t(list.size());
    }
    PALPATE_TRY(Volume numbers,
                make_rows<uint16_t>(labels.grid(), task.part(0.8, 1.0),
                                    [&](uint32_t y, uint32_t z, std::span<uint16_t> row) {
                                        const auto [first, last] = found.row(y, z);
                                        for (uint32_t i = first; i < last; ++i)
                                            std::fill(row.begin() + found.runs()[i].begin,
                                                      row.begin() + found.runs()[i].end,
                                                      number[found.roots()[i]]);
                                    }));
    return Components{std::move(numbers), std::move(list)};
}

Result<Volume> remove_islands(const Volume& labels, const IslandsOptions& options,
                              const Task& task) {
    PALPATE_TRY(check_labels(labels, "islands"));
    if (!(options.least_ml >= 0.0))
        return fail("islands: expected a volume of 0 ml or more, found {:g}", options.least_ml);
    const auto kind = [&](uint16_t label) {
        return !options.label || label == *options.label ? label : uint16_t{0};
    };
    LabelRuns found;
    if (!found.find(labels, kind, options.neighbours, task.part(0.0, 0.7)))
        return stopped();
    const std::vector<uint64_t> counts = counts_of(found);
    const double sample_ml = ml_of_sample(labels.grid());
    std::map<uint16_t, uint32_t> largest; // of each label the root; of equal ones the first
    for (uint32_t i = 0; i < counts.size(); ++i)
        if (counts[i] > 0) {
            const auto [at, is_new] = largest.try_emplace(found.runs()[i].label, i);
            if (!is_new && counts[i] > counts[at->second])
                at->second = i;
        }
    return relabelled(
        labels, found,
        [&](uint32_t i) -> uint16_t {
            const uint32_t root = found.roots()[i];
            const uint16_t label = found.runs()[i].label;
            const bool goes = counts[root] < options.least_count ||
                              double(counts[root]) * sample_ml < options.least_ml ||
                              (options.largest_alone && largest.at(label) != root);
            return goes ? uint16_t{0} : label;
        },
        labels.type(), task.part(0.7, 1.0));
}

Result<Volume> keep_piece(const Volume& labels, const PieceOptions& options, const Task& task) {
    PALPATE_TRY(check_labels(labels, "piece"));
    PALPATE_ASSERT(glm::all(glm::lessThan(options.at, labels.size())));
    uint16_t label = 0;
    read_labels(labels, glm::ivec3(options.at), glm::ivec3(1), &label);
    if (label == 0)
        return fail("piece: expected a sample with a label, found the background");
    LabelRuns found;
    const auto kind = [label](uint16_t one) { return one == label ? label : uint16_t{0}; };
    if (!found.find(labels, kind, options.neighbours, task.part(0.0, 0.7)))
        return stopped();
    auto [run, end] = found.row(options.at.y, options.at.z);
    while (found.runs()[run].end <= options.at.x)
        ++run;
    const uint32_t kept = found.roots()[run];
    return relabelled(
        labels, found, [&](uint32_t i) { return found.roots()[i] == kept ? label : uint16_t{0}; },
        labels.type(), task.part(0.7, 1.0));
}

Result<Volume> split_pieces(const Volume& labels, const SplitOptions& options, const Task& task) {
    PALPATE_TRY(check_labels(labels, "split"));
    if (options.label == 0)
        return fail("split: expected a label 1 .. 65535, found 0, which is the background");
    if (!(options.least_ml >= 0.0))
        return fail("split: expected a volume of 0 ml or more, found {:g}", options.least_ml);
    const auto present = label_bounds(labels, task.part(0.0, 0.1));
    LabelRuns found;
    const auto kind = [&](uint16_t one) { return one == options.label ? one : uint16_t{0}; };
    if (!present || !found.find(labels, kind, options.neighbours, task.part(0.1, 0.7)))
        return stopped();
    const std::vector<uint64_t> counts = counts_of(found);
    std::vector<uint32_t> roots;
    for (uint32_t i = 0; i < counts.size(); ++i)
        if (counts[i] > 0 && double(counts[i]) * ml_of_sample(labels.grid()) >= options.least_ml)
            roots.push_back(i);
    std::stable_sort(roots.begin(), roots.end(),
                     [&](uint32_t a, uint32_t b) { return counts[a] > counts[b]; });
    std::map<uint32_t, uint16_t> given; // by root
    uint32_t next = 1;
    for (size_t n = 1; n < roots.size(); ++n, ++next) {
        while (next <= 65535 && (present->contains(uint16_t(next)) ||
                                 std::ranges::find(options.locked, next) != options.locked.end()))
            ++next;
        if (next > 65535)
            return fail(
                "split: expected at most {} pieces, so many labels are free, found {}: leave out "
                "small ones",
                n, roots.size());
        given.emplace(roots[n], uint16_t(next));
    }
    const bool holds = next == 1 || visit_scalar(labels.type(), [&]<class T>(T) {
                           return double(next - 1) <= double(std::numeric_limits<T>::max());
                       });
    return relabelled(
        labels, found,
        [&](uint32_t i) {
            const auto at = given.find(found.roots()[i]);
            return at == given.end() ? options.label : at->second;
        },
        holds ? labels.type() : ScalarType::u16, task.part(0.7, 1.0));
}

Result<Volume> fill_holes(const Volume& labels, const HolesOptions& options, const Task& task) {
    PALPATE_TRY(check_labels(labels, "holes"));
    LabelRuns found;
    if (!found.find(
            labels, [](uint16_t label) { return uint16_t(label == 0); }, options.background,
            task.part(0.0, 0.5)))
        return stopped();
    const Holes holes(labels, found);
    return relabelled(
        labels, found, [&](uint32_t i) { return holes.filling(i, options.label); }, labels.type(),
        task.part(0.6, 1.0));
}

} // namespace palpate
