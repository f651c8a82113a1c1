#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace palpate::view {

// The first of NAME, NAME-1, NAME-2, .. with the ending of `name` that names nothing yet, so that
// no file is replaced: "labels-1.nii.gz". `number` is the first one tried; 0: the name as it is. Of
// .mhd the .raw beside it is free, too.
std::filesystem::path free_name(const std::filesystem::path& name, uint32_t number = 0);

// A name as a part of a file's name: letters and digits of ASCII, '-' and all else of UTF-8 stay,
// and '_' stands for the rest.
std::string file_word(std::string name);

// The text of a field for a file's name, in which `typed` stands, when `name` is proposed and
// `proposed` was before: a proposed name follows, and the folder before it stays; what a person
// typed stays as it is.
std::string followed_name(const std::string& typed, const std::string& proposed,
                          const std::string& name);

} // namespace palpate::view
