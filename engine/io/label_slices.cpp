#include "engine/io/label_slices.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate::io {

namespace {

constexpr double kMostOff = 0.05; // of a sample

} // namespace

Result<LabelSlices> LabelSlices::make(const Volume& labels, const Grid& grid) {
    if (labels.type() != ScalarType::u8 && labels.type() != ScalarType::u16)
        return fail("its samples are of the type {}, expected labels of the type u8 or u16",
                    name_of(labels.type()));
    LabelSlices slices(labels, grid.size);
    const glm::dmat4 grid_from_label = index_from_world(grid) * labels.grid().world_from_index;
    glm::dmat4 whole(1.0);
    std::array<bool, 3> taken{};
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 3; ++row)
            whole[column][row] = std::round(grid_from_label[column][row]);
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
        glm::dvec4 at(0, 0, 0, 1);
        for (int axis = 0; axis < 3; ++axis)
            if ((corner >> axis & 1) != 0)
                at[axis] = labels.size()[axis] - 1.0;
        const glm::dvec4 off = glm::abs((grid_from_label - whole) * at);
        most = std::max({most, off.x, off.y, off.z});
    }
    bool permuted = true;
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            if (whole[column][row] != 0.0) {
                permuted = permuted && std::abs(whole[column][row]) == 1.0 && !taken[size_t(row)] &&
                           slices.sign_[column] == 0;
                taken[size_t(row)] = true;
                slices.axis_[size_t(column)] = row;
                slices.sign_[column] = whole[column][row] > 0 ? 1 : -1;
            }
    if (!permuted || !(taken[0] && taken[1] && taken[2]) || !(most <= kMostOff)) {
        const glm::dvec3 own = spacing_mm(labels.grid()), other = spacing_mm(grid);
        return fail(
            "its samples lie on another grid: {} x {} x {} samples at {:.4g} x {:.4g} x {:.4g} mm, "
            "expected those of {} x {} x {} at {:.4g} x {:.4g} x {:.4g} mm",
            labels.size().x, labels.size().y, labels.size().z, own.x, own.y, own.z, grid.size.x,
            grid.size.y, grid.size.z, other.x, other.y, other.z);
    }
    slices.start_ = glm::dvec3(whole[3]);
    for (size_t axis = 0; axis < 3; ++axis)
        if (slices.axis_[axis] == 2) {
            const auto from = static_cast<int64_t>(slices.start_.z);
            const int at = static_cast<int>(axis);
            const int64_t to = from + slices.sign_[at] * (int64_t{labels.size()[at]} - 1);
            slices.first_ = std::min(from, to);
            slices.last_ = std::max(from, to);
        }
    return slices;
}

uint64_t LabelSlices::read(int64_t slice, std::vector<uint16_t>& out) const {
    out.assign(size_t{size_.x} * size_.y, 0);
    const int across = axis_[0] == 2 ? 0 : axis_[1] == 2 ? 1 : 2;
    const int64_t at = (slice - static_cast<int64_t>(start_.z)) * sign_[across];
    const glm::uvec3 size = labels_.size();
    if (at < 0 || at >= size[across])
        return 0;
    // The other two axes: rows along the first of them, which is x unless x runs across.
    const int along = across == 0 ? 1 : 0, down = 3 - across - along;
    const bool in_grid = slice >= 0 && slice < size_.z;
    uint64_t outside = 0;
    std::vector<float> row(size[along]);
    for (uint32_t j = 0; j < size[down]; ++j) {
        glm::uvec3 from(0);
        from[across] = static_cast<uint32_t>(at);
        from[down] = j;
        if (along == 0) {
            read_row(labels_, from, size.x, row.data());
        } else {
            for (uint32_t i = 0; i < size[along]; ++i) {
                from[along] = i;
                row[i] = labels_.value(from);
            }
        }
        for (uint32_t i = 0; i < size[along]; ++i) {
            if (row[i] == 0.0f)
                continue;
            glm::i64vec2 place(0);
            place[axis_[size_t(along)]] =
                static_cast<int64_t>(start_[axis_[size_t(along)]]) + sign_[along] * int64_t{i};
            place[axis_[size_t(down)]] =
                static_cast<int64_t>(start_[axis_[size_t(down)]]) + sign_[down] * int64_t{j};
            if (!in_grid || place.x < 0 || place.y < 0 || place.x >= size_.x || place.y >= size_.y)
                ++outside;
            else
                out[size_t(place.y) * size_.x + size_t(place.x)] = static_cast<uint16_t>(row[i]);
        }
    }
    return outside;
}

Result<void> LabelSlices::visit(const std::string& name, const std::stop_token& stop,
                                const Visit& visit) const {
    std::vector<uint16_t> samples, labels;
    uint64_t outside = 0;
    bool is_empty = true;
    for (int64_t slice = first(); slice <= last(); ++slice) {
        if (stop.stop_requested())
            return fail("{}: writing was stopped", name);
        outside += read(slice, samples);
        labels.clear();
        uint16_t before = 0; // runs are long
        for (const uint16_t sample : samples)
            if (sample != std::exchange(before, sample) && sample != 0)
                labels.push_back(sample);
        std::sort(labels.begin(), labels.end());
        labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
        if (labels.empty())
            continue;
        is_empty = false;
        visit(static_cast<uint32_t>(slice), samples, labels);
    }
    if (outside > 0)
        return fail("{}: {} samples with a label lie beyond the images of the reference", name,
                    outside);
    if (is_empty)
        return fail("{}: the label map has no labels, so that there is nothing to write", name);
    return {};
}

} // namespace palpate::io
