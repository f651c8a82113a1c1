#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/volume/brick_cache.h"
#include "engine/volume/volume.h"

// Brick files (.pbv): a volume as packed bricks with their ranges, coarser levels of it, and
// checksums, read a brick at a time. The layout: docs/reference/brick-file.md.
namespace palpate {

// A volume to be written brick by brick; only the bricks being written need to exist.
struct BrickStream {
    Grid grid;
    ScalarType type{};
    bool labels = false;  // coarser levels pick a label instead of averaging
    std::string modality; // as DICOM names it, up to 31 bytes
    // The brick at a position (in bricks). Called once for each, from several threads.
    std::function<BrickPtr(glm::uvec3 position)> brick;
};
BrickStream stream_of(const Volume& volume);

struct BrickFileWriting {
    std::stop_token stop;
    std::function<void(double share)> progress; // 0 .. 1, from one thread at a time
};

// Writes a brick file. Memory in use: about 10 MB for each thread, and 1/60 of the volume for the
// index. The same samples give the same bytes. The file appears whole or not at all.
Result<void> save_brick_file(const std::filesystem::path& path, const BrickStream& stream,
                             const BrickFileWriting& writing = {});

// A brick file that is open. Its volumes fetch samples from it as they are read, and keep it open;
// reading a damaged brick throws SourceError.
struct BrickFile {
    Volume volume;
    std::vector<Volume> coarser; // level 1, 2, ..; each half as fine, the last one brick
    bool labels = false;
    std::string modality;
    std::function<BrickCache::Stats()> cache; // of all levels together
};

// Whether a file begins as brick files do; false where it cannot be read.
bool is_brick_file(const std::filesystem::path& path);

// Reads header and index and checks them; what they claim is held against the length of the file
// before memory is taken for it. Samples are checked when they are fetched. `cache_bytes` bounds
// the samples kept in memory beside those in use.
Result<BrickFile> open_brick_file(const std::filesystem::path& path,
                                  uint64_t cache_bytes = uint64_t{512} << 20);

} // namespace palpate
