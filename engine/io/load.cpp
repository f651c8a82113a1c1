#include "engine/io/narrow.h"
#include "engine/io/sandbox.h"
#include "engine/io/volume_io.h"

namespace palpate {

namespace {

Result<LoadedVolume> load(const std::filesystem::path& path, const ReadOptions& options,
                          io::VolumeKind kind) {
    const Result<io::DecodedVoxels> voxels =
        io::decode_in_child({path, options.frame, options.series}, options);
    if (!voxels)
        return fail("{}", voxels.error().message);
    return io::narrow(path.string(), voxels->decoded, voxels->claim, voxels->bytes(), kind,
                      options.max_memory_bytes);
}

} // namespace

Result<LoadedVolume> load_volume(const std::filesystem::path& path, const ReadOptions& options) {
    return load(path, options, io::VolumeKind::values);
}

Result<LoadedVolume> load_labels(const std::filesystem::path& path, const ReadOptions& options) {
    return load(path, options, io::VolumeKind::labels);
}

} // namespace palpate
