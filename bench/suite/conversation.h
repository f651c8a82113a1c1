#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/fd.h"
#include "engine/base/json.h"

namespace palpate::bench {

// A program that is told a line of JSON at a time and answers each with one.
class Conversation {
 public:
    // Starts `command` (found on the path); what it writes beside its answers, to stderr, goes into
    // the file `said`.
    static Result<Conversation> start(std::vector<std::string> command,
                                      const std::filesystem::path& said);

    // Waits for the answer. Fails where the program has ended, or answers no JSON.
    Result<Json> ask(const Json& question);

    Conversation(Conversation&& other) = default;
    ~Conversation(); // says goodbye by closing, and waits for the program's end

 private:
    Conversation(Fd socket, int child, std::filesystem::path said)
        : socket_(std::move(socket)), child_(child), said_(std::move(said)) {}

    Fd socket_;
    int child_;
    std::filesystem::path said_;
    std::string heard_; // of the next answer
};

} // namespace palpate::bench
