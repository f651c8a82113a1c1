#pragma once

#include <string>

#include "engine/io/decoder.h"

// The messages a decoding child writes to its parent: one JSON object a line.
namespace palpate::io {

std::string alive_report(const std::string& file);
std::string claim_report(const VoxelClaim& claim);
std::string error_report(const std::string& message);
std::string decoded_report(const Decoded& decoded);

// Writes one line; does nothing for fd -1. The child ends when the parent no longer listens.
void write_report(int fd, const std::string& line);

// The reports of a child so far.
struct Reported {
    std::optional<VoxelClaim> claim;
    std::optional<Decoded> decoded;
    std::optional<std::string> error;
    std::string at; // the file of a series it works on; empty when not told
};

// Takes one line in. An error when it is not one of the above: the child is then not believed.
Result<void> take_report(const std::string& line, Reported& reported);

} // namespace palpate::io
