#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"

// The files that the options of a command name, and the one rule they all keep: no file is written
// that is also read, or that two options write.
namespace palpate {

enum class FileUse {
    read,
    write,
    write_text, // "-" is standard output
};

// A file and the option that names it.
struct NamedFile {
    std::string option;
    std::string path; // "" names no file
    FileUse use = FileUse::read;
    bool makes_folder = false; // its folder is made before it is written
};

// A volume that is read: a file, those that hold its voxels, a folder, the slices of a pattern;
// nothing of a synthetic one. Of a volume that is written: the file, and the .raw beside a .mhd.
void append_volume(std::vector<NamedFile>& files, const std::string& option,
                   const std::string& path, FileUse use = FileUse::read);

// An error where a file that is written is named twice, by whatever path, link or second name, or
// lies in a folder that is read and is there already; where two write to standard output; and
// where "-" is no name.
Result<void> each_its_own(std::span<const NamedFile> files);

// An error where a file cannot be written: before the work, not after an hour of it.
Result<void> all_can_be_written(std::span<const NamedFile> files);

} // namespace palpate
