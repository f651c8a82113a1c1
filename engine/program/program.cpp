#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/program/program.h"

#include "engine/base/file.h"
#include "engine/base/json_value.h"
#include "engine/base/log.h"
#include "engine/base/printable.h"
#include "engine/base/profile.h"
#include "engine/program/named_files.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/program.h"
#include "engine/version/version.h"

namespace palpate {

namespace {

// Runs a command; where a trace is asked for and the command succeeds, writes it.
Result<void> profiled(const Command& command, const std::string& trace) {
    if (trace.empty())
        return command.run();
    profile::start();
    profile::name_thread("main");
    const Result<void> result = [&] {
        const profile::Scope scope("command");
        return command.run();
    }();
    return result ? profile::save(trace) : result;
}

// The same for a command whose files appear together, or not at all.
Result<void> run_whole(const Command& command, const std::string& trace) {
    if (!command.files_together)
        return profiled(command, trace);
    FilesTogether files;
    const Result<void> done = profiled(command, trace);
    return done ? files.commit() : done;
}

// The version, and the commit where the build knew it; nothing that asks a driver.
std::string version_text() {
    const std::string_view commit = built_from();
    return commit == "unknown" ? "palpate " PALPATE_VERSION
                               : fmt::format("palpate {} ({})", PALPATE_VERSION, commit);
}

// Without a command that is known: the word in its place, if there is one, and those that are.
CLI::RequiredError with_unknown_word(const CLI::App& app, const CLI::RequiredError& error,
                                     std::span<const ProgramCommand> commands) {
    const std::vector<std::string> words = app.remaining();
    if (!app.get_subcommands().empty())
        return error;
    std::string known;
    for (const ProgramCommand& entry : commands)
        known += fmt::format("{}{}", known.empty() ? "" : ", ", entry.name);
    const std::string found = words.empty() ? "none" : fmt::format("'{}'", words.front());
    return {fmt::format("expected a command, one of {}, found {}", known, found),
            CLI::ExitCodes::RequiredError};
}

// The first option or word that no command takes, in the order of the command line, and the option
// that it resembles.
CLI::ExtrasError with_nearest_option(const CLI::App& app) {
    const std::vector<std::string> words = app.remaining(true);
    const auto is_option = [](const std::string& word) { return word.starts_with("-"); };
    const auto option = std::find_if(words.begin(), words.end(), is_option);
    const std::string found = option != words.end() ? *option : words.front();
    const std::vector<CLI::App*> subs = app.get_subcommands();
    const CLI::App& command = subs.empty() ? app : *subs.front();
    std::vector<std::string_view> known;
    for (const CLI::App* owner : {&command, &app})
        for (const CLI::Option* each : owner->get_options())
            for (const std::string& name : each->get_lnames())
                known.push_back(name);
    const size_t begin = std::min(found.find_first_not_of('-'), found.size());
    const std::string bare = found.substr(begin, found.find('=', begin) - begin);
    const std::string_view near = nearest_name(bare, known);
    return {
        fmt::format("expected an option or a value of palpate {}, found '{}'{}", command.get_name(),
                    found, near.empty() ? "" : fmt::format("; did you mean --{}?", near)),
        CLI::ExitCodes::ExtrasError};
}

// Before the work: no file that is written is named by two options, and each can be.
Result<void> expect_files(const Command& command, const std::string& trace) {
    std::vector<NamedFile> files = command.files();
    files.push_back({"--profile", trace, FileUse::write});
    Result<void> apart = each_its_own(files);
    return apart ? all_can_be_written(files) : apart;
}

} // namespace

int run_program(int argc, char** argv, std::span<const ProgramCommand> commands) {
    CLI::App app(
        "See, touch and carve a CT or MR volume. Places are millimetres in the patient's left, "
        "posterior, superior axes (LPS, as DICOM has them; NIfTI and 3D Slicer show RAS: the first "
        "two change sign).");
    app.require_subcommand(1);
    app.set_version_flag("--version", version_text, "Print version and commit, and exit");
    bool verbose = false, quiet = false;
    app.add_flag("--verbose", verbose, "Print more messages");
    app.add_flag("--quiet", quiet, "Print errors and warnings only");
    std::string trace;
    app.add_option(
           "--profile", trace,
           "Write a trace of the run for ui.perfetto.dev or chrome://tracing (default: none)")
        ->type_name("FILE");

    std::vector<std::pair<CLI::App*, Command>> added;
    for (const ProgramCommand& entry : commands) {
        CLI::App* sub = app.add_subcommand(entry.name, entry.purpose);
        sub->fallthrough();
        sub->footer(
            "Every command also takes --quiet, --verbose and --profile FILE, a trace of the run "
            "for "
            "ui.perfetto.dev or chrome://tracing.");
        added.emplace_back(sub, entry.add(*sub));
    }
    refuse_not_finite(app);
    const auto tell = [&](const CLI::Error& error) {
        std::ostringstream out, messages; // they quote the words of the command line
        const int code = app.exit(error, out, messages);
        std::cerr << (code != 0 ? "palpate: error: " : "") << printable_lines(messages.str());
        const Result<void> printed = print_text(out.str());
        return code != 0 ? 2 : printed ? 0 : 1;
    };
    try {
        app.parse(argc, argv);
    } catch (const CLI::RequiredError& error) {
        // An option that is required may be missing because it is misspelt.
        if (!app.get_subcommands().empty() && !app.remaining(true).empty())
            return tell(with_nearest_option(app));
        return tell(with_unknown_word(app, error, commands));
    } catch (const CLI::ExtrasError&) {
        return tell(with_nearest_option(app));
    } catch (const CLI::ParseError& error) {
        return tell(error);
    }
    if (verbose)
        log::set_level(log::Level::debug);
    if (quiet)
        log::set_level(log::Level::error);
    try {
        for (auto& [sub, command] : added)
            if (sub->parsed()) {
                Result<void> result = expect_files(command, trace);
                if (result)
                    result = run_whole(command, trace);
                if (!result)
                    log::error("{}", result.error().message);
                else if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
                    log::error("standard output cannot be written");
                else
                    return 0;
                return 1;
            }
    } catch (const std::bad_alloc&) {
        log::error("out of memory");
    } catch (const std::exception& error) {
        log::error("{}", error.what());
    }
    return 1;
}

} // namespace palpate
