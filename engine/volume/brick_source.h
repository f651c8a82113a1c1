#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>

namespace palpate {

// The kBrickSamples samples of one brick, kept while a reader holds them.
using SamplesPtr = std::shared_ptr<const std::byte[]>;

// Samples that existed when a volume was opened cannot be read: the file is damaged or was
// truncated, or memory ran out. what() is one sentence that names the file.
struct SourceError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Storage of samples that bricks do not hold themselves. Safe from any number of threads.
class BrickSource {
 public:
    virtual ~BrickSource() = default;

    // The samples of brick `key`, x fastest, padding included, aligned to 64 bytes. Throws
    // SourceError; what is returned is what was stored, never something near it.
    virtual SamplesPtr fetch(uint64_t key) const = 0;
};

} // namespace palpate
