#pragma once

#include <optional>
#include <span>
#include <string>

#include "engine/base/error.h"
#include "engine/render/brick_atlas.h"
#include "engine/render/residency.h"
#include "engine/render/texel_storage.h"
#include "engine/volume/changes.h"

namespace palpate {

// The format, place and size that a volume should have on the GPU.
struct GpuVolumeWish {
    TexelFormat format = TexelFormat::automatic;
    Residency residency = Residency::automatic;
    uint64_t limit_bytes = 0;        // for image, or atlas with its table and staging
    uint64_t beside_atlas_bytes = 0; // what else an atlas needs of the limit
    size_t needed_bricks = 0;        // that can be seen; counts for an atlas only
    size_t most_bricks = 0;          // of an atlas, beside what fits; 0: no other limit

    size_t bricks() const {
        return most_bricks > 0 ? std::min(most_bricks, needed_bricks) : needed_bricks;
    }
    uint64_t atlas_limit_bytes() const {
        return limit_bytes - std::min(limit_bytes, beside_atlas_bytes);
    }
};

// One volume on the GPU, kept up to date brick by brick: as one 3D image, or as an atlas of those
// bricks that are asked for.
//
// There is no flat copy of the voxels on the CPU: bricks are converted straight into staging memory
// of a few megabytes. value = texel * value_scale + value_bias.
class GpuVolume {
 public:
    // A dense one holds every brick from the start, an atlas none. Fails with a sentence when the
    // volume is larger than the device's images or than the limit; nothing is down-sampled.
    // Uploads are recorded into `commands`.
    static Result<GpuVolume> make(GpuDevice& device, std::string name, const Volume& volume,
                                  const GpuVolumeWish& wish, Commands& commands);

    // Bytes of device memory that make() would take.
    static uint64_t bytes_for(const GpuDevice& device, const Volume& volume,
                              const GpuVolumeWish& wish);

    // Uploads the bricks in which `next` differs from the snapshot held now (changed_bricks() tells
    // them), and holds `next`. Size and type must be those of the first snapshot. An atlas uploads
    // its bricks when it is asked (BrickAtlas::upload_wanted()).
    void update(const Volume& next, std::span<const ChangedBrick> changed, Commands& commands);

    // Whether this is what make() would give for such a volume and wish, or serves as well.
    bool suits(const Volume& next, const GpuVolumeWish& wish) const;

    bool is_atlas() const { return atlas_.has_value(); }
    BrickAtlas& atlas() { return *atlas_; }

    GpuImage& image() { return image_ ? *image_ : atlas_->image(); } // or the atlas's
    uint64_t bytes() {
        return image_ ? image_->bytes() : atlas_->image().bytes() + atlas_->table().bytes();
    }
    const Volume& snapshot() const { return snapshot_; }
    float value_scale() const { return storage_.scale; }
    float value_bias() const { return storage_.bias; }
    const std::string& reason() const { return reason_; } // a phrase: why it lies as it does

 private:
    struct Choice;
    static Choice choose(const GpuDevice& device, const Volume& volume, const GpuVolumeWish& wish);
    GpuVolume(GpuDevice& device, const Volume& volume, const GpuVolumeWish& wish,
              TexelStorage storage);
    // Uploads the box about the changed blocks of each brick.
    void upload(const Volume& from, std::span<const ChangedBrick> bricks, Commands& commands);

    GpuDevice* device_;
    Volume snapshot_;
    GpuVolumeWish wish_;
    TexelStorage storage_;
    std::string reason_;
    std::optional<GpuImage> image_;
    std::optional<BrickAtlas> atlas_;
};

} // namespace palpate
