#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"

// Readers meet files that were cut short or changed at random. Every outcome is a result, or one
// sentence that names the file and a cause.
namespace palpate::fuzz {

// Nothing that the files of the tables can hold needs more memory.
constexpr uint64_t kMostBytes = 64 << 20;

struct Reader {
    std::string name;               // "PNG": names failures, and seeds what is changed
    std::string file_name;          // what the damaged file is called: "slice.png"
    std::vector<std::string> seeds; // bytes of valid files, which must be read
    // Reads one file; absent: it was read. Checks what it read with gtest's expectations.
    std::function<std::optional<Error>(const std::filesystem::path&)> read;
    // Makes checksums right again, so that damage gets past them; may be empty.
    std::function<std::string(std::string)> sign = {};
    // Whether the child process that reads may die of a damaged file, with a cause.
    bool may_die = false;
    bool in_child = false; // every file starts a child: fewer of them
};

struct Outcomes {
    uint64_t read = 0, refused = 0;
    uint64_t died = 0;                           // of the refused, those in which the child died
    std::map<std::string, uint64_t> why;         // of the refused: messages without names, numbers
    std::map<std::string, std::string> examples; // one message each
};

// A valid file with 1 to 4 changes, or cut short; sometimes both. A function of its arguments: of
// nine seeds one after another, each begins with a kind of damage of its own.
std::string damaged(const std::string& bytes, uint64_t seed);

// The fault in the message of an error; empty when it is one printable sentence that names the file
// and says more.
std::string fault_of(const std::string& message, const std::filesystem::path& path);

// Reads the seeds, and `count` damaged files, each under the reader's file name in `folder`. Faults
// are failures of the running test; the first that breaks ends it.
Outcomes meet_damaged_files(const Reader& reader, uint64_t count,
                            const std::filesystem::path& folder);

// The tables, one a kind of file.
std::vector<Reader> volume_readers(); // decoded in this process: our own code
std::vector<Reader> dicom_readers();  // decoded in this process
std::vector<Reader> sandboxed_readers();
std::vector<Reader> mesh_readers();
std::vector<Reader> text_readers(); // scenes and strokes

} // namespace palpate::fuzz
