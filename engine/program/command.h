#pragma once

#include <functional>
#include <vector>

#include "engine/base/error.h"
#include "engine/program/named_files.h"

namespace palpate {

// One sub-command: adds its options to `app` and returns what runs it, and which files its options
// name, of which main() lets none be written that another option names. An error is printed to
// standard error as one sentence, and the program exits with 1; wrong usage exits with 2.
//
// The files of a command that fails, or is interrupted, are not written: none of several takes its
// name before the command has succeeded. A command that sees to that itself, or whose work is not
// one thing, says `files_together = false`.
struct Command {
    std::function<Result<void>()> run;
    std::function<std::vector<NamedFile>()> files;
    bool files_together = true;
};

} // namespace palpate
