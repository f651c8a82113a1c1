#include "engine/render/cell_map.h"

#include <algorithm>
#include <limits>

#include "engine/scene/least_value.h"

namespace palpate {

namespace {

// Side of the cells that bounds for MIP come from: about as wide as the rays of a tile lie apart if
// a pixel is a sample. By a simulation of a head CT cells of 4 would save a tenth of the samples,
// for four times the lookups.
constexpr uint32_t kMipSide = 8;

// Edits that reach more cells than this, and more than a quarter of all, are not patched: all cells
// of 256^3 samples take about as long. Nor are those of more boxes.
constexpr uint64_t kMostPatched = 100000;
constexpr size_t kMostBoxes = 1024;

// Numbers of tiles a frame, while distances are raised: some 0.1 ms, and 128 KiB.
constexpr size_t kTilesLookedAt = 8, kTilesUploaded = 8;

VisibleValues visible_values(const RayCastLayer& layer) {
    if (layer.mode == RayMode::alpha)
        return VisibleValues(make_table(layer.transfer));
    std::vector<double> values;
    for (const IsoSurface& iso : layer.isos)
        values.push_back(iso.value);
    return VisibleValues(values);
}

} // namespace

CellBox changed_cells(const ChangedBrick& brick, uint32_t side, glm::uvec3 count) {
    const auto [low, high] = changed_samples(brick);
    const glm::uvec3 first = brick.position * kBrickSide + low;
    const glm::uvec3 last = brick.position * kBrickSide + high - 1u;
    return {glm::min((glm::max(first, glm::uvec3(1)) - 1u) / side, count - 1u),
            glm::min(last / side + 1u, count)};
}

VolumeCells::VolumeCells(const Volume& volume)
    : ranges_(make_cell_ranges(volume, cell_side_for(volume.size()))),
      margin_(range_margin(volume)) {}

void VolumeCells::update(const Volume& next, std::span<const ChangedBrick> changed) {
    update_cell_ranges(ranges_, next, changed);
    margin_ = std::max(margin_, range_margin(next)); // of every cell's test
}

bool CellMap::is_for(const RayCastLayer& layer, float value_scale, float value_bias) const {
    if (!shown_ || shown_->mode != layer.mode)
        return false;
    switch (layer.mode) {
        case RayMode::mip:
            return shown_->value_scale == value_scale && shown_->value_bias == value_bias &&
                   shown_->least == shows_least_value(layer.transfer);
        case RayMode::alpha: // distances do not depend on how texels are stored
            return shown_->transfer == layer.transfer;
        case RayMode::iso:
            return std::equal(
                layer.isos.begin(), layer.isos.end(), shown_->isos.begin(), shown_->isos.end(),
                [](const IsoSurface& iso, double value) { return iso.value == value; });
    }
    return false;
}

void CellMap::show(const RayCastLayer& layer, float value_scale, float value_bias,
                   std::optional<std::span<const ChangedBrick>> changed, Commands& commands) {
    const bool mip = layer.mode == RayMode::mip;
    const glm::uvec3 count = ranges().count;
    const bool patched = is_for(layer, value_scale, value_bias) &&
                         (mip || shown_->margin == cells_->margin()) && changed &&
                         changed->size() <= kMostBoxes;
    const uint32_t reach = mip ? 0 : kMaxCellDistance - 1;
    std::vector<CellBox> boxes;
    uint64_t reached = 0;
    if (patched) {
        std::vector<CellBox> touched;
        for (const ChangedBrick& brick : *changed) {
            touched.push_back(changed_cells(brick, ranges().side, count));
            cells_visited_ += touched.back().cells();
        }
        boxes = joined(touched, reach, count);
    }
    for (const CellBox& box : boxes)
        reached += widened(box, reach, count).cells();
    if (!patched || reached > std::max(kMostPatched, uint64_t{ranges().cells() / 4})) {
        show_all(layer, value_scale, value_bias, commands);
        return;
    }
    if (mip) {
        for (CellBox& box : boxes) {
            const uint32_t wider = shown_->side / ranges().side;
            box = {box.low / wider, (box.high + (wider - 1)) / wider};
        }
    } else {
        for (CellBox& box : boxes)
            box = update_distances(box);
        std::erase_if(boxes, [](const CellBox& box) { return box.empty(); });
        cells_visited_ += distances_.raise(kTilesLookedAt) * CellDistances::kTileSide *
                          CellDistances::kTileSide * CellDistances::kTileSide;
        const std::vector<CellBox> raised = distances_.take_raised(kTilesUploaded);
        boxes.insert(boxes.end(), raised.begin(), raised.end());
    }
    upload(boxes, commands);
}

void CellMap::show_all(const RayCastLayer& layer, float value_scale, float value_bias,
                       Commands& commands) {
    generation_ = cells_->next_generation();
    cells_visited_ += ranges().cells();
    Shown wanted{layer.mode,    {}, {}, value_scale, value_bias, cells_->margin(), ranges().side,
                 ranges().count};
    if (layer.mode == RayMode::alpha)
        wanted.transfer = layer.transfer;
    for (const IsoSurface& iso : layer.isos)
        if (layer.mode == RayMode::iso)
            wanted.isos.push_back(iso.value);
    if (layer.mode == RayMode::mip) {
        wanted.least = shows_least_value(layer.transfer);
        while (wanted.side < kMipSide) {
            wanted.side *= 2;
            wanted.count = (wanted.count + 1u) / 2u;
        }
        distances_ = {};
    } else {
        visible_ = visible_values(layer);
        distances_ = CellDistances(
            occupied_cells(ranges(), visible_, wanted.margin, layer.mode == RayMode::iso),
            ranges().count);
    }
    shown_ = std::move(wanted);
    if (!image_ || image_->shape().size != shown_->count) {
        image_.reset();
        image_.emplace(*device_, "macro-cells",
                       ImageShape{.type = VK_IMAGE_TYPE_3D, .size = shown_->count});
    }
    const CellBox all{glm::uvec3(0), shown_->count};
    upload({&all, 1}, commands);
}

// Tells which cells of a box hold something now; a box of those whose distances became lower.
CellBox CellMap::update_distances(const CellBox& touched) {
    const CellRanges& ranges = this->ranges();
    const bool gaps_matter = shown_->mode == RayMode::iso && !ranges.gaps.empty();
    std::vector<uint8_t> occupied;
    occupied.reserve(touched.cells());
    for (uint32_t z = touched.low.z; z < touched.high.z; ++z)
        for (uint32_t y = touched.low.y; y < touched.high.y; ++y)
            for (uint32_t x = touched.low.x; x < touched.high.x; ++x)
                occupied.push_back(
                    is_occupied(ranges, x + ranges.count.x * (y + size_t{ranges.count.y} * z),
                                visible_, shown_->margin, gaps_matter));
    const CellBox lowered = distances_.update(touched, occupied);
    cells_visited_ += touched.cells() + lowered.cells();
    return lowered;
}

float CellMap::texel_of(glm::uvec3 cell) const {
    if (shown_->mode != RayMode::mip)
        return distances_.at(cell);
    const CellRanges& ranges = this->ranges();
    const uint32_t wider = shown_->side / ranges.side;
    const glm::uvec3 low = cell * wider, high = glm::min(low + wider, ranges.count);
    const float sign = shown_->least ? -1.0f : 1.0f;
    float highest = -std::numeric_limits<float>::infinity(); // of sign * value
    for (uint32_t z = low.z; z < high.z; ++z)
        for (uint32_t y = low.y; y < high.y; ++y)
            for (uint32_t x = low.x; x < high.x; ++x) {
                const size_t at = x + ranges.count.x * (y + size_t{ranges.count.y} * z);
                highest = std::max(highest, shown_->least ? -ranges.low[at] : ranges.high[at]);
            }
    return (highest - sign * shown_->value_bias) / shown_->value_scale;
}

void CellMap::upload(std::span<const CellBox> boxes, Commands& commands) {
    if (boxes.empty())
        return;
    struct Layer {
        glm::uvec3 low, size;
    };
    std::vector<Layer> layers;
    uint64_t most = 0; // cells of one
    for (const CellBox& box : boxes)
        for (uint32_t z = box.low.z; z < box.high.z; ++z) {
            const glm::uvec3 size(box.high.x - box.low.x, box.high.y - box.low.y, 1);
            layers.push_back({{box.low.x, box.low.y, z}, size});
            most = std::max(most, uint64_t{size.x} * size.y);
        }
    commands.upload(*image_, layers.size(), most * sizeof(float),
                    [&](size_t first, size_t count, std::span<std::byte> to) {
                        auto* const texels = reinterpret_cast<float*>(to.data());
                        std::vector<Commands::Region> regions;
                        size_t at = 0;
                        for (const Layer& layer : std::span(layers).subspan(first, count)) {
                            regions.push_back({.buffer_offset = at * sizeof(float),
                                               .image_offset = layer.low,
                                               .size = layer.size});
                            for (uint32_t y = 0; y < layer.size.y; ++y)
                                for (uint32_t x = 0; x < layer.size.x; ++x)
                                    texels[at++] = texel_of(layer.low + glm::uvec3(x, y, 0));
                        }
                        return regions;
                    });
}

} // namespace palpate
