#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "engine/io/decoder.h"
#include "engine/io/volume_io.h"

namespace palpate::io {

enum class VolumeKind { values, labels };

// A volume from the voxels a decoder gave back, in the type that load_volume or load_labels
// promises. `bytes` holds exactly what the claim stands for. `name` begins every sentence.
//
// Several components are one when they agree everywhere (grey stored as colour), with a warning;
// else an error.
Result<LoadedVolume> narrow(const std::string& name, const Decoded& decoded,
                            const VoxelClaim& claim, std::span<const std::byte> bytes,
                            VolumeKind kind, uint64_t max_memory_bytes);

} // namespace palpate::io
