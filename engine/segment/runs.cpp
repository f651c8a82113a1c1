#include "engine/segment/runs.h"

#include <algorithm>

#include "engine/base/assert.h"
#include "engine/base/forest.h"
#include "engine/segment/label_samples.h"

namespace palpate {

std::pair<uint32_t, uint32_t> LabelRuns::row(uint32_t y, uint32_t z) const {
    const size_t at = y + size_t{size_.y} * z;
    return {first_of_row_[at], first_of_row_[at + 1]};
}

glm::uvec3 LabelRuns::first_sample(uint32_t run) const {
    const auto at = std::upper_bound(first_of_row_.begin(), first_of_row_.end(), run);
    const auto number = static_cast<size_t>(at - first_of_row_.begin()) - 1;
    return {runs_[run].begin, number % size_.y, number / size_.y};
}

bool LabelRuns::find(const Volume& labels, const Kind& kind, Neighbours neighbours,
                     const Task& task) {
    size_ = labels.size();
    std::vector<uint16_t> kind_of(65536);
    for (size_t label = 0; label < kind_of.size(); ++label)
        kind_of[label] = kind(uint16_t(label));
    struct Plane {
        std::vector<LabelRun> runs;
        std::vector<uint32_t> first;
    };
    std::vector<Plane> planes(size_.z);
    const bool read = run_all(size_.z, task.part(0.0, 0.6), [&](size_t z) {
        std::vector<uint16_t> samples(size_t{size_.x} * size_.y);
        read_labels(labels, {0, 0, int(z)}, {int(size_.x), int(size_.y), 1}, samples.data());
        for (size_t y = 0; y < size_.y; ++y) {
            planes[z].first.push_back(uint32_t(planes[z].runs.size()));
            const uint16_t* row = samples.data() + y * size_.x;
            for (uint32_t x = 0; x < size_.x;) {
                const uint32_t begin = x;
                const uint16_t own = kind_of[row[x]];
                while (x < size_.x && (row[x] == row[begin] || kind_of[row[x]] == own))
                    ++x;
                if (own != 0)
                    planes[z].runs.push_back({begin, x, row[begin]});
            }
        }
    });
    if (!read)
        return false;
    runs_.clear();
    first_of_row_.clear();
    for (Plane& plane : planes) {
        for (const uint32_t first : plane.first)
            first_of_row_.push_back(uint32_t(runs_.size()) + first);
        runs_.insert(runs_.end(), plane.runs.begin(), plane.runs.end());
        plane = {};
    }
    PALPATE_ASSERT_CMP(runs_.size(), <, size_t{1} << 32);
    first_of_row_.push_back(uint32_t(runs_.size()));
    kinds_.resize(runs_.size());
    for (size_t i = 0; i < runs_.size(); ++i)
        kinds_[i] = kind_of[runs_[i].label];

    const int reach = neighbours == Neighbours::faces ? 1 : neighbours == Neighbours::edges ? 2 : 3;
    Forest<std::vector<uint32_t>> forest{std::vector<uint32_t>(runs_.size())};
    // `aside`: 1 where runs that touch at an edge or corner only are joined too.
    const auto join = [&](std::pair<uint32_t, uint32_t> a, std::pair<uint32_t, uint32_t> b,
                          uint32_t aside) {
        for (; a.first < a.second; ++a.first) {
            const LabelRun& own = runs_[a.first];
            while (b.first < b.second && runs_[b.first].end + aside <= own.begin)
                ++b.first;
            for (uint32_t i = b.first; i < b.second && runs_[i].begin < own.end + aside; ++i)
                if (kinds_[i] == kinds_[a.first])
                    forest.join(a.first, i);
        }
    };
    for (uint32_t z = 0; z < size_.z; ++z) {
        if (task.stop.stop_requested())
            return false;
        for (uint32_t y = 0; y < size_.y; ++y) {
            if (y > 0)
                join(row(y, z), row(y - 1, z), reach > 1 ? 1 : 0);
            for (int dy = -1; z > 0 && dy <= 1; ++dy) {
                const int apart = 1 + std::abs(dy);
                if (apart <= reach && y + uint32_t(dy) < size_.y)
                    join(row(y, z), row(y + uint32_t(dy), z - 1), apart < reach ? 1 : 0);
            }
        }
    }
    roots_.resize(runs_.size());
    for (uint32_t i = 0; i < runs_.size(); ++i)
        roots_[i] = forest.root(i);
    return true;
}

} // namespace palpate
