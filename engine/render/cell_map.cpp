#include "engine/render/cell_map.h"

#include <cstring>

#include "engine/render/occupancy.h"

namespace palpate {

namespace {

// Of the cells that bounds for MIP come from: about as wide as the rays of a tile lie apart where a
// pixel is a sample. With cells of 4 rays would take a tenth fewer samples of a head CT, for four
// times the lookups: no faster.
constexpr uint32_t kMipSide = 8;

} // namespace

CellMap::CellMap(Device& device, const Volume& volume)
    : device_(&device),
      ranges_(make_cell_ranges(volume, cell_side_for(volume.size()))),
      version_(volume.version()),
      margin_(range_margin(volume)) {}

void CellMap::update(const Volume& next, std::span<const ChangedBrick> changed) {
    update_cell_ranges(ranges_, next, changed);
    version_ = next.version();
    margin_ = range_margin(next);
}

void CellMap::show(const RayCastLayer& layer, float value_scale, float value_bias) {
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
    if (shown_ && shown_->mode == wanted.mode && shown_->transfer == wanted.transfer &&
        shown_->isos == wanted.isos && shown_->version == version_ &&
        shown_->value_scale == value_scale && shown_->value_bias == value_bias)
        return;

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
        const VisibleValues visible = layer.mode == RayMode::alpha
                                          ? VisibleValues(make_table(layer.transfer))
                                          : VisibleValues(wanted.isos);
        std::vector<uint8_t> cells =
            occupied_cells(ranges_, visible, margin_, layer.mode == RayMode::iso);
        chebyshev_distances(cells, ranges_.count);
        texels.assign(cells.begin(), cells.end());
        distances_ = std::move(cells);
    }
    upload(texels, wanted.count);
    shown_ = std::move(wanted);
}

void CellMap::upload(const std::vector<float>& texels, glm::uvec3 count) {
    if (!image_ || image_->shape().size != count) {
        image_.reset();
        image_.emplace(*device_, "macro-cells",
                       ImageShape{.type = VK_IMAGE_TYPE_3D, .size = count});
    }
    Buffer staging(*device_, "macro-cell upload", texels.size() * sizeof(float), Memory::upload);
    std::memcpy(staging.mapped().data(), texels.data(), staging.bytes());
    Commands commands(*device_);
    const Commands::Region region{.buffer_offset = 0, .image_offset = {}, .size = count};
    commands.copy(staging, *image_, std::span(&region, 1));
    commands.submit();
    commands.finish();
}

} // namespace palpate
