// palpate bench: the suites are a program of their own, so that who draws need not build them.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "apps/palpate/command.h"

namespace palpate {

namespace {

namespace fs = std::filesystem;
constexpr const char* kProgram = "palpate-bench";

// Beside this program, or on $PATH; empty where it is in neither.
fs::path bench_program() {
    std::error_code error;
    std::vector<fs::path> folders{fs::read_symlink("/proc/self/exe", error).parent_path()};
    if (const char* path = std::getenv("PATH")) {
        std::istringstream entries(path);
        for (std::string entry; std::getline(entries, entry, ':');)
            folders.emplace_back(entry);
    }
    for (const fs::path& folder : folders)
        if (fs::is_regular_file(folder / kProgram, error) &&
            ::access((folder / kProgram).c_str(), X_OK) == 0)
            return folder / kProgram;
    return {};
}

// Ends this program: palpate-bench goes on in its place, with the same command line.
Result<void> start(const CLI::App& app) {
    const fs::path program = bench_program();
    if (program.empty())
        return fail(
            "expected the program {} beside palpate or on PATH, found none: it is a package of its "
            "own (from a checkout: cmake --build build/dev --target palpate-bench)",
            kProgram);
    std::vector<std::string> words{"palpate"};
    const CLI::App& palpate = *app.get_parent();
    for (const char* flag : {"--verbose", "--quiet"})
        if (palpate.count(flag) > 0)
            words.emplace_back(flag);
    if (palpate.count("--profile") > 0)
        words.insert(words.end(), {"--profile", palpate["--profile"]->as<std::string>()});
    words.emplace_back("bench");
    for (const std::string& word : app.remaining())
        words.push_back(word);
    std::vector<char*> argv;
    for (std::string& word : words)
        argv.push_back(word.data());
    argv.push_back(nullptr);
    ::execv(program.c_str(), argv.data());
    return fail("{}: cannot be started: {}", program.string(), std::strerror(errno));
}

} // namespace

Command add_bench(CLI::App& app) {
    app.set_help_flag(); // palpate-bench has the help, and all options
    app.fallthrough(false);
    app.prefix_command();
    return {[&app] { return start(app); }, [] { return std::vector<NamedFile>(); },
            /*files_together=*/false};
}

} // namespace palpate
