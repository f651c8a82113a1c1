#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace palpate::view {

struct BrowserEntry {
    std::string name;
    bool is_folder = false;
    uint64_t bytes = 0; // of a file

    friend bool operator==(const BrowserEntry&, const BrowserEntry&) = default;
};
// Folders first, each by name in the order of bytes; names that begin with a dot are left out. What
// cannot be looked at (a broken link, say) is listed as a file of 0 bytes. An error where the
// folder cannot be read.
Result<std::vector<BrowserEntry>> list_folder(const std::filesystem::path& folder);

// Files that were opened last, the newest first, at most kMostRecent: a list in JSON, in
// state_file("recent.json").
constexpr size_t kMostRecent = 12;
std::filesystem::path recent_file();
// None where the file is not there, or is no such list.
std::vector<std::string> load_recent(const std::filesystem::path& file);
// Puts a path first. An error where the file cannot be written.
Result<void> add_recent(const std::filesystem::path& file, const std::string& path);

} // namespace palpate::view
