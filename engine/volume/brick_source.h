#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>

namespace palpate {

// The kBrickSamples samples of one brick, kept for as long as somebody reads them.
using SamplesPtr = std::shared_ptr<const std::byte[]>;

// Samples that were there when a volume was opened cannot be had any more: the file is damaged, was
// cut meanwhile, or memory ran out. what() is one sentence that names the file.
struct SourceError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Where bricks keep the samples they do not hold themselves. Safe from any number of threads.
class BrickSource {
 public:
    virtual ~BrickSource() = default;

    // The samples of brick `key`, x fastest, padding included, aligned to 64 bytes. Throws
    // SourceError; what is returned is what was stored, never something near it.
    virtual SamplesPtr fetch(uint64_t key) const = 0;
};

} // namespace palpate
