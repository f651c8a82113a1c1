#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace palpate::bench {

// One descriptor of a child: one of ours, or one of its own that an earlier
// redirection made; or, where `file` is given, that file, written anew.
struct Redirection {
    int descriptor = 0;
    int from = -1;
    std::filesystem::path file{};
};

// Starts a program, looked for on PATH, with our environment; its process number. Descriptors that
// are not redirected are ours.
Result<int> spawn(std::vector<std::string> command, std::span<const Redirection> redirections);

// Waits until it ended: its exit code, or 128 and the signal that ended it.
int wait_for(int child);

} // namespace palpate::bench
