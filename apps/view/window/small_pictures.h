#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace palpate::view {

// Small pictures of files that were opened, for the list of them: PNG in a folder, named by a hash
// of the file's path, so that no name is in it. Bytes are squares of SeriesPreviews::kSide_px with
// 4 bytes a pixel. An empty folder keeps none.
Result<void> keep_small_picture(const std::filesystem::path& folder, const std::string& path,
                                const std::vector<std::byte>& rgba);
Result<std::vector<std::byte>> load_small_picture(const std::filesystem::path& folder,
                                                  const std::string& path);
// Removes those of files that are not listed.
void forget_small_pictures(const std::filesystem::path& folder,
                           const std::vector<std::string>& listed);

} // namespace palpate::view
