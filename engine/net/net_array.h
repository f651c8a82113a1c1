#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/volume/volume.h"

// Arrays as nnInteractive sends them: "NNIA", the version 1, a codec, the type of elements by its
// name, the shape, and blosc2 chunks, each with its length before and after compression. Elements
// are in C order: the last axis is the fastest. A volume's axes are z, y, x there.
namespace palpate {

// An array of elements of one byte ("uint8", "int8" or "bool"), of the shape that is expected. All
// lengths are checked before memory for elements is taken. Refused, in a sentence ("expected ..,
// found
// .."): another shape or type, damage, bytes behind the end.
Result<std::vector<uint8_t>> read_net_array(std::span<const std::byte> wire,
                                            std::span<const int64_t> shape);

// The array of a box of bytes, x fastest.
std::vector<std::byte> write_net_array(std::span<const uint8_t> bytes,
                                       std::span<const int64_t> shape);

// A volume as an array of four axes (1, z, y, x) in its own type; samples without data hold the
// least value of those that have some. Takes the samples once, and once more compressed.
std::vector<std::byte> write_net_image(const Volume& volume);

} // namespace palpate
