#pragma once

#include <sys/wait.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/support/paths.h"
#include "tests/support/temporary_folder.h"

namespace palpate {

// The result of a run of the program.
struct ProgramRun {
    int exit_code = -1; // 128 + n where signal n ended it
    std::string output, messages;
};

// Tests that run the built program on files of a folder of their own.
class ProgramTest : public TemporaryFolder {
 protected:
    // Arguments are passed as they are; no shell reads them.
    ProgramRun run(const std::vector<std::string>& arguments) const {
        std::string command = quoted(kProgram);
        for (const std::string& argument : arguments)
            command += " " + quoted(argument);
        command += " >" + quoted(file("stdout").string()) + " 2>" + quoted(file("stderr").string());
        const int status = std::system(command.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
                bytes_of("stdout"), bytes_of("stderr")};
    }

 private:
    static std::string quoted(const std::string& text) {
        std::string out = "'";
        for (const char c : text)
            out += c == '\'' ? std::string("'\\''") : std::string(1, c);
        return out + "'";
    }
};

} // namespace palpate
