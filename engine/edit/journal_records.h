#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace palpate {

// The bytes of a journal (journal.h): kJournalMagic, then records of 4 bytes of length, 4 of CRC-32
// and the payload.
//
// Payloads are text, or begin and end with a line of text. All begin with '{', "undo" or "redo".
constexpr std::string_view kJournalMagic = "palpate journal 2\n";
constexpr std::string_view kAnyMagic = "palpate journal "; // and the version

// The payload is not empty: zeros, which a file may end in after a loss of power, are no record
// though the CRC of nothing is 0.
std::string record_of(std::string_view payload);

// The payload of the record at `at`, which moves behind it; nothing where it is not whole.
std::optional<std::string_view> next_record(std::string_view file, size_t& at);

// Whole records of steps from `at` on, wherever they begin: what could be read of a damaged file.
size_t count_steps(std::string_view file, size_t at);

// The end of the file behind the last whole record.
//
// A write that never ended leaves a record that is cut, or that ends in zeros, as no payload does,
// and nothing after it. Whatever else is no record was one, and has changed since.
struct JournalTail {
    enum class Kind { none, unfinished, damaged };
    Kind kind = Kind::none;
    std::string what; // of damaged: what was expected and what was found
    size_t later = 0; // whole records behind the damage
};
JournalTail tail_of(std::string_view file, size_t at);

} // namespace palpate
