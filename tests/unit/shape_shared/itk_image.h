#pragma once

#include <itkImage.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "engine/volume/builder.h"
#include "tests/support/paths.h"

namespace palpate {

inline const std::filesystem::path kHeadCt =
    "/usr/share/doc/invesalius-examples/examples/Cranium.inv3";

using ItkMask = itk::Image<unsigned char, 3>;
using ItkLabels = itk::Image<unsigned short, 3>;

// An image of ITK with spacing, at the origin.
template <class Image>
typename Image::Pointer itk_image(const Grid& grid,
                                  const std::vector<typename Image::PixelType>& samples) {
    auto image = Image::New();
    typename Image::RegionType region;
    region.SetSize({{grid.size.x, grid.size.y, grid.size.z}});
    image->SetRegions(region);
    const glm::dvec3 spacing = spacing_mm(grid);
    image->SetSpacing(&spacing.x);
    image->Allocate();
    std::copy(samples.begin(), samples.end(), image->GetBufferPointer());
    return image;
}

template <class T>
std::vector<T> samples_as(const Volume& volume) {
    std::vector<T> out(sample_count(volume.grid()));
    std::vector<float> row(volume.size().x);
    T* to = out.data();
    for (uint32_t z = 0; z < volume.size().z; ++z)
        for (uint32_t y = 0; y < volume.size().y; ++y) {
            read_row(volume, {0, y, z}, volume.size().x, row.data());
            to = std::transform(row.begin(), row.end(), to, [](float v) { return T(v); });
        }
    return out;
}

// Samples above `level`, as 1.
inline Volume above(const Volume& volume, float level) {
    return make_volume(volume.grid(), ScalarType::u8,
                       [&](glm::uvec3 i) { return volume.value(i) > level ? 1.0 : 0.0; });
}

} // namespace palpate
