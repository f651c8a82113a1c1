#include "engine/segment/interpolate_slices.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "engine/segment/label_samples.h"
#include "engine/segment/rows.h"
#include "engine/segment/signed_distance.h"

namespace palpate {

namespace {

// The labels that take the samples of a slice between, x fastest of the two axes left.
struct Between {
    std::vector<float> lowest; // of the blends that are negative
    std::vector<uint16_t> label;
};

class BetweenSlices {
 public:
    BetweenSlices(const Volume& labels, int axis) : labels_(labels), axis_(axis) {
        plane_ = labels.size();
        plane_[axis] = 1;
        samples_ = size_t{plane_.x} * plane_.y * plane_.z;
    }

    Result<Volume> run(const Task& task) {
        const std::map<uint16_t, std::vector<uint32_t>> drawn = drawn_slices();
        size_t done = 0;
        for (const auto& [label, slices] : drawn) {
            const Task part = task.part(double(done) / double(drawn.size()),
                                        double(done + 1) / double(drawn.size()));
            ++done;
            std::optional<std::vector<float>> before;
            for (size_t i = 1; i < slices.size(); ++i) {
                if (slices[i] == slices[i - 1] + 1) {
                    before.reset();
                    continue;
                }
                if (!before) {
                    PALPATE_TRY(before, distances(slices[i - 1], label, part));
                }
                PALPATE_TRY(std::vector<float> after, distances(slices[i], label, part));
                for (uint32_t k = slices[i - 1] + 1; k < slices[i]; ++k)
                    blend(k, label, *before, after,
                          float(k - slices[i - 1]) / float(slices[i] - slices[i - 1]));
                before = std::move(after);
            }
        }
        return visit_scalar(labels_.type(), [&]<class T>(T) {
            return make_rows<T>(labels_.grid(), {task.stop, {}},
                                [&](uint32_t y, uint32_t z, std::span<T> row) { fill(y, z, row); });
        });
    }

 private:
    std::vector<uint16_t> slice(uint32_t k) const {
        glm::ivec3 first(0);
        first[axis_] = int(k);
        std::vector<uint16_t> out(samples_);
        read_labels(labels_, first, glm::ivec3(plane_), out.data());
        return out;
    }

    std::map<uint16_t, std::vector<uint32_t>> drawn_slices() const {
        std::map<uint16_t, std::vector<uint32_t>> out;
        for (uint32_t k = 0; k < labels_.size()[axis_]; ++k) {
            const std::vector<uint16_t> samples = slice(k);
            for (const uint16_t label : std::set<uint16_t>(samples.begin(), samples.end()))
                if (label != 0)
                    out[label].push_back(k);
        }
        return out;
    }

    Result<std::vector<float>> distances(uint32_t k, uint16_t label, const Task& task) const {
        const Grid grid{plane_, labels_.grid().world_from_index};
        const std::vector<uint16_t> samples = slice(k);
        // The border is nowhere near in a slice full of the label.
        const double most = glm::length(glm::dvec3(plane_) * spacing_mm(grid));
        PALPATE_TRY(const Volume away,
                    signed_distance(make_volume<uint16_t>(grid, samples),
                                    {.of = DistanceOf::label, .label = label, .max_mm = most},
                                    {task.stop, {}}));
        std::vector<float> out(samples_);
        read_box(away, glm::ivec3(0), glm::ivec3(plane_), packed(plane_), out.data());
        return out;
    }

    void blend(uint32_t k, uint16_t label, const std::vector<float>& before,
               const std::vector<float>& after, float share) {
        Between& to = between_[k];
        to.lowest.resize(samples_, 0.0f);
        to.label.resize(samples_, 0);
        for (size_t i = 0; i < samples_; ++i) {
            const float blended = (1.0f - share) * before[i] + share * after[i];
            if (blended < to.lowest[i]) {
                to.lowest[i] = blended;
                to.label[i] = label;
            }
        }
    }

    template <class T>
    void fill(uint32_t y, uint32_t z, std::span<T> row) const {
        std::vector<uint16_t> own(row.size());
        read_labels(labels_, {0, y, z}, {int(row.size()), 1, 1}, own.data());
        for (uint32_t x = 0; x < row.size(); ++x) {
            glm::uvec3 at(x, y, z);
            const auto found = between_.find(at[axis_]);
            at[axis_] = 0;
            row[x] = T(own[x]);
            if (own[x] == 0 && found != between_.end())
                row[x] = T(found->second.label[at.x + plane_.x * (at.y + size_t{plane_.y} * at.z)]);
        }
    }

    const Volume& labels_;
    int axis_;
    glm::uvec3 plane_;
    size_t samples_;
    std::map<uint32_t, Between> between_; // by slice
};

} // namespace

Result<Volume> interpolate_slices(const Volume& labels, int axis, const Task& task) {
    PALPATE_TRY(check_labels(labels, "interpolation between slices"));
    if (axis < 0 || axis > 2)
        return fail("interpolation between slices: expected an axis 0, 1 or 2, found {}", axis);
    return BetweenSlices(labels, axis).run(task);
}

} // namespace palpate
