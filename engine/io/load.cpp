#include <algorithm>

#include "engine/base/option_name.h"
#include "engine/io/brick_file.h"
#include "engine/io/hounsfield.h"
#include "engine/io/narrow.h"
#include "engine/io/sandbox.h"
#include "engine/io/volume_io.h"

namespace palpate {

namespace {

Result<LoadedVolume> open_bricks(const std::filesystem::path& path, const ReadOptions& options,
                                 io::VolumeKind kind) {
    PALPATE_TRY(BrickFile file, open_brick_file(path, std::min(options.brick_cache_bytes,
                                                               options.max_memory_bytes / 2)));
    const ScalarType type = file.volume.type();
    if (kind == io::VolumeKind::labels && type != ScalarType::u8 && type != ScalarType::u16)
        return fail("{}: expected labels of type u8 or u16, found {}", path.string(),
                    name_of(type));
    LoadedVolume loaded{std::move(file.volume),  {}, {}, std::move(file.modality),
                        std::move(file.coarser), {}};
    if (options.resample_slices)
        loaded.warnings.push_back(fmt::format("{}: {} has no effect on a brick file", path.string(),
                                              Option{"resample-slices"}));
    if (const uint64_t missing = loaded.volume.no_data_count(); missing > 0)
        loaded.warnings.push_back(
            fmt::format("{}: {} samples hold no data", path.string(), missing));
    return loaded;
}

Result<LoadedVolume> load(const std::filesystem::path& path, const ReadOptions& options,
                          io::VolumeKind kind) {
    if (is_brick_file(path))
        return open_bricks(path, options, kind);
    PALPATE_TRY(const io::DecodedVoxels voxels,
                io::decode_in_child({path, options.frame, options.series, options.resample_slices,
                                     options.middle_image},
                                    options));
    return io::narrow(path.string(), voxels.decoded, voxels.claim, voxels.bytes(), kind,
                      options.max_memory_bytes);
}

} // namespace

Result<LoadedVolume> load_volume(const std::filesystem::path& path, const ReadOptions& options) {
    PALPATE_TRY(LoadedVolume loaded, load(path, options, io::VolumeKind::values));
    if (lacks_ct_offset(loaded.modality, loaded.volume, loaded.coarser))
        loaded.warnings.push_back(
            fmt::format("{}: a CT without values below -200, so its values are taken as HU + {:g}: "
                        "bone at 300 HU is at {:g} here",
                        path.string(), kLostCtOffset, 300.0 + kLostCtOffset));
    return loaded;
}

std::vector<std::string> all_notes(const LoadedVolume& loaded) {
    std::vector<std::string> all;
    for (const SeriesInfo& series : loaded.series)
        all.push_back(series_line(series));
    all.insert(all.end(), loaded.notes.begin(), loaded.notes.end());
    return all;
}

Result<LoadedVolume> load_labels(const std::filesystem::path& path, const ReadOptions& options) {
    return load(path, options, io::VolumeKind::labels);
}

} // namespace palpate
