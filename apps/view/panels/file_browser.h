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
    uint64_t bytes = 0;     // of a file
    int64_t modified_s = 0; // since 1970 (UTC); 0: not known

    friend bool operator==(const BrowserEntry&, const BrowserEntry&) = default;
};
// Folders first, each by name; names that begin with a dot are left out. What
// cannot be looked at (a broken link, say) is listed as a file of 0 bytes. An error where the
// folder cannot be read.
Result<std::vector<BrowserEntry>> list_folder(const std::filesystem::path& folder);

enum class EntryOrder { name, size, date };
// Folders first; names in the order of bytes, but numbers in them by their values: 1, 2, 10. Of
// what is equal in size or date, by name. `falls`: the largest or newest first.
void sort_entries(std::vector<BrowserEntry>& entries, EntryOrder order, bool falls);

// Whether a file may be one that is opened, by its name: a known ending, or one that says nothing,
// as files of DICOM have (none, or digits alone), unless it is a usual name of a text, such as
// SHA256SUMS. A picture alone is no volume.
bool may_be_opened(const std::string& name);

// How many files are pictures, by their names: those of a folder may be the slices of a volume.
size_t count_pictures(const std::vector<BrowserEntry>& entries);

// The places of entries that are listed: those with `part` in their names, whatever the case; of
// files those that may be opened, unless all are wanted.
std::vector<size_t> listed_entries(const std::vector<BrowserEntry>& entries,
                                   const std::string& part, bool all_files);

// Folders that a person often goes to: the home folder, those of files that were opened last, and
// disks that are mounted in `mounts`, each once.
struct BrowserPlace {
    std::string name;
    std::filesystem::path folder;

    friend bool operator==(const BrowserPlace&, const BrowserPlace&) = default;
};
std::vector<BrowserPlace> browser_places(const std::filesystem::path& home,
                                         const std::vector<std::string>& recent,
                                         const std::vector<std::filesystem::path>& mounts);

// Files that were opened last, the newest first, at most kMostRecent: a list in JSON, in
// state_file("recent.json").
constexpr size_t kMostRecent = 12;
std::filesystem::path recent_file();
// None where the file is not there, or is no such list.
std::vector<std::string> load_recent(const std::filesystem::path& file);
// Puts a path first. An error where the file cannot be written.
Result<void> add_recent(const std::filesystem::path& file, const std::string& path);

} // namespace palpate::view
