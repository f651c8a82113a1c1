#pragma once

#include <span>

#include "engine/program/command.h"

namespace CLI {
class App;
}

namespace palpate {

// A sub-command of a program: its name, its purpose in one line, and what adds it.
struct ProgramCommand {
    const char* name;
    const char* purpose;
    Command (*add)(CLI::App&);
};

// The main function of a program with such commands: reads the command line, runs one command and
// returns the exit status: 0 done, 1 failed, 2 wrong usage.
int run_program(int argc, char** argv, std::span<const ProgramCommand> commands);

} // namespace palpate
