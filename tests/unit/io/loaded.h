#pragma once

#include <stdexcept>

#include "engine/io/volume_io.h"

namespace palpate {

// The volume of a file that is to be read; throws the error's sentence where it is not.
inline LoadedVolume loaded(const std::filesystem::path& path, const ReadOptions& options = {}) {
    Result<LoadedVolume> result = load_volume(path, options);
    if (!result)
        throw std::runtime_error(result.error().message);
    return std::move(*result);
}

// The sentence of a file that is to be refused; "loaded" where it was not.
inline std::string error_of(const std::filesystem::path& path, const ReadOptions& options = {}) {
    const Result<LoadedVolume> result = load_volume(path, options);
    return result ? "loaded" : result.error().message;
}

} // namespace palpate
