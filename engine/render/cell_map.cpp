#include "engine/render/cell_map.h"

#include <algorithm>
#include <cstring>

#include "engine/render/occupancy.h"

namespace palpate {

namespace {

// Of the cells that bounds for MIP come from: about as wide as the rays of a tile lie apart where a
// pixel is a sample. By a simulation of a head CT cells of 4 would save a tenth of the samples, for
// four times the lookups.
constexpr uint32_t kMipSide = 8;

// Boxes of more cells than this are not patched: all cells of 256^3 samples take about as long.
constexpr int64_t kMostPatched = 100000;

VisibleValues visible_values(RayMode mode, const TransferFunction& transfer,
                             const std::vector<double>& isos) {
    return mode == RayMode::alpha ? VisibleValues(make_table(transfer)) : VisibleValues(isos);
}

} // namespace

CellMap::CellMap(GpuDevice& device, const Volume& volume)
    : device_(&device),
      ranges_(make_cell_ranges(volume, cell_side_for(volume.size()))),
      version_(volume.version()),
      margin_(range_margin(volume)) {}

void CellMap::update(const Volume& next, std::span<const ChangedBrick> changed) {
    update_cell_ranges(ranges_, next, changed);
    version_ = next.version();
    if (const double margin = range_margin(next); margin != margin_) {
        margin_ = margin; // of every cell's test
        shown_.reset();
    }
    const auto side = static_cast<int>(ranges_.side);
    for (const ChangedBrick& brick : changed) // of the cells that share a sample with it
        for (uint32_t block = 0; block < kBlocksPerBrick; ++block) {
            if (!(brick.blocks >> block & 1))
                continue;
            const glm::ivec3 first =
                glm::ivec3(brick.position * kBrickSide) +
                int{kBlockSide} * glm::ivec3(block % kBlocksPerSide,
                                             block / kBlocksPerSide % kBlocksPerSide,
                                             block / (kBlocksPerSide * kBlocksPerSide));
            const glm::ivec3 low = glm::max(first - 1, glm::ivec3(0)) / side;
            const glm::ivec3 high =
                glm::min((first + int{kBlockSide} - 1) / side + 1, glm::ivec3(ranges_.count));
            const bool none = touched_low_ == touched_high_;
            touched_low_ = none ? low : glm::min(touched_low_, low);
            touched_high_ = none ? high : glm::max(touched_high_, high);
        }
}

void CellMap::show(const RayCastLayer& layer, float value_scale, float value_bias,
                   Commands& commands) {
    const bool mip = layer.mode == RayMode::mip;
    if (!mip) // distances do not depend on how texels are stored
        value_scale = 1.0f, value_bias = 0.0f;
    Shown wanted{layer.mode,    {},      {}, value_scale, value_bias, ranges_.side,
                 ranges_.count, version_};
    if (layer.mode == RayMode::alpha)
        wanted.transfer = layer.transfer;
    for (const IsoSurface& iso : layer.isos)
        if (layer.mode == RayMode::iso)
            wanted.isos.push_back(iso.value);
    const bool same_look = shown_ && shown_->mode == wanted.mode &&
                           shown_->transfer == wanted.transfer && shown_->isos == wanted.isos &&
                           shown_->value_scale == value_scale && shown_->value_bias == value_bias;
    if (same_look && shown_->version == version_)
        return;
    if (same_look && !mip && patch(wanted, commands)) {
        shown_->version = version_;
        return;
    }
    touched_low_ = touched_high_ = glm::ivec3(0);
    loose_ = false;

    std::vector<float> texels;
    if (mip) {
        CellRanges wide = ranges_;
        while (wide.side < kMipSide)
            wide = coarser(wide);
        wanted.side = wide.side;
        wanted.count = wide.count;
        texels = std::move(wide.high);
        for (float& texel : texels)
            texel = (texel - value_bias) / value_scale;
    } else {
        std::vector<uint8_t> cells =
            occupied_cells(ranges_, visible_values(wanted.mode, wanted.transfer, wanted.isos),
                           margin_, layer.mode == RayMode::iso);
        chebyshev_distances(cells, ranges_.count);
        texels.assign(cells.begin(), cells.end());
        distances_ = std::move(cells);
    }
    upload(texels, wanted.count, commands);
    shown_ = std::move(wanted);
}

bool CellMap::patch(const Shown& wanted, Commands& commands) {
    const glm::ivec3 count(ranges_.count), reach(kMaxCellDistance - 1);
    const glm::ivec3 low = glm::max(touched_low_ - reach, glm::ivec3(0));
    const glm::ivec3 size = glm::min(touched_high_ + reach, count) - low;
    const int64_t cells = int64_t{size.x} * size.y * size.z;
    if (touched_low_ == touched_high_) // the edit changed no sample
        return true;
    if (cells > kMostPatched)
        return false;
    const VisibleValues visible = visible_values(wanted.mode, wanted.transfer, wanted.isos);
    const bool gaps_matter = wanted.mode == RayMode::iso && !ranges_.gaps.empty();
    std::vector<uint8_t> filled(static_cast<size_t>(cells)); // cells that came to hold something
    const auto for_each = [&](glm::ivec3 from, glm::ivec3 to, const auto& visit) {
        for (int z = from.z; z < to.z; ++z)
            for (int y = from.y; y < to.y; ++y)
                for (int x = from.x; x < to.x; ++x) {
                    const glm::ivec3 at = glm::ivec3(x, y, z) - low;
                    visit(x + size_t(count.x) * (y + size_t(count.y) * z),
                          at.x + size_t(size.x) * (at.y + size_t(size.y) * at.z));
                }
    };
    for_each(touched_low_, touched_high_, [&](size_t cell, size_t local) {
        const bool seen = ranges_.low[cell] <= ranges_.high[cell] &&
                          ((gaps_matter && ranges_.gaps[cell]) ||
                           visible.any(ranges_.low[cell] - margin_, ranges_.high[cell] + margin_));
        if (!seen && distances_[cell] == 0) {
            distances_[cell] = 1;
            loose_ = true;
        }
        filled[local] = seen;
    });
    chebyshev_distances(filled, glm::uvec3(size));
    const BufferSlice from = commands.staging(static_cast<uint64_t>(cells) * sizeof(float));
    auto* texels = reinterpret_cast<float*>(from.mapped().data());
    for_each(low, low + size, [&](size_t cell, size_t local) {
        distances_[cell] = std::min(distances_[cell], filled[local]);
        texels[local] = distances_[cell];
    });
    const Commands::Region region{
        .buffer_offset = 0, .image_offset = glm::uvec3(low), .size = glm::uvec3(size)};
    commands.begin_pass("cell patch");
    commands.copy(from, *image_, std::span(&region, 1));
    commands.end_pass();
    touched_low_ = touched_high_ = glm::ivec3(0);
    return true;
}

void CellMap::upload(const std::vector<float>& texels, glm::uvec3 count, Commands& commands) {
    if (!image_ || image_->shape().size != count) {
        image_.reset();
        image_.emplace(*device_, "macro-cells",
                       ImageShape{.type = VK_IMAGE_TYPE_3D, .size = count});
    }
    const size_t plane = size_t{count.x} * count.y; // texels
    commands.upload(*image_, count.z, plane * sizeof(float),
                    [&](size_t first, size_t planes, std::span<std::byte> to) {
                        std::memcpy(to.data(), &texels[first * plane], to.size());
                        return std::vector<Commands::Region>{{.buffer_offset = 0,
                                                              .image_offset = {0, 0, first},
                                                              .size = {count.x, count.y, planes}}};
                    });
}

} // namespace palpate
