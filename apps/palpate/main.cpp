#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/palpate/command.h"
#include "apps/palpate/named_files.h"
#include "apps/palpate/option_checks.h"
#include "apps/palpate/output.h"
#include "bench/suite/environment.h"
#include "engine/base/log.h"
#include "engine/base/printable.h"
#include "engine/base/profile.h"
#include "engine/decode/serve.h"

namespace {

using palpate::Command;

struct Entry {
    const char* name;
    const char* purpose;
    Command (*add)(CLI::App&);
};

constexpr Entry kCommands[] = {
    {"compare", "Compare two pictures, meshes, volumes or label maps", palpate::add_compare},
    {"devices", "List haptic devices, and home or calibrate one", palpate::add_devices},
    {"doctor", "List what this machine offers: Vulkan devices, memory, real-time policy",
     palpate::add_doctor},
    {"info", "Describe a volume: size, spacing, orientation, type, range", palpate::add_info},
    {"edit", "Apply strokes of tools to labels or grey values", palpate::add_edit},
    {"filter", "Filter a volume: smooth, derive, combine, resample", palpate::add_filter},
    {"convert", "Read a volume in any format and write it in another", palpate::add_convert},
    {"bench", "Measure speed beside error", palpate::add_bench},
    {"measure", "Measure lengths, angles, areas, balls and labels", palpate::add_measure},
    {"project", "Create, describe and change a project folder", palpate::add_project},
    {"render", "Draw a scene or a volume to a picture", palpate::add_render},
    {"seeds", "Place seeds in known objects as a person would, for trials", palpate::add_seeds},
    {"segment", "Find objects from seeds: fast marching, region growing and others",
     palpate::add_segment},
    {"surface", "Extract an iso-surface, or the surfaces of labels, as a mesh",
     palpate::add_surface},
    {"touch", "Run the haptic loop with a simulated hand and device", palpate::add_touch},
    {"view", "Open a window with slices and 3D, and edit by hand", palpate::add_view},
};

// Runs a command; where a trace is asked for and the command succeeds, writes it.
palpate::Result<void> profiled(const Command& command, const std::string& trace) {
    if (trace.empty())
        return command.run();
    palpate::profile::start();
    palpate::profile::name_thread("main");
    const palpate::Result<void> result = [&] {
        const palpate::profile::Scope scope("command");
        return command.run();
    }();
    return result ? palpate::profile::save(trace) : result;
}

// The version, and the commit where the build knew it; nothing that asks a driver.
std::string version_text() {
    const std::string_view commit = palpate::bench::built_from();
    return commit == "unknown" ? "palpate " PALPATE_VERSION
                               : fmt::format("palpate {} ({})", PALPATE_VERSION, commit);
}

// Without a command that is known: the word in its place, if there is one, and those that are.
CLI::RequiredError with_unknown_word(const CLI::App& app, const CLI::RequiredError& error) {
    const std::vector<std::string> words = app.remaining();
    if (!app.get_subcommands().empty())
        return error;
    std::string known;
    for (const Entry& entry : kCommands)
        known += fmt::format("{}{}", known.empty() ? "" : ", ", entry.name);
    const std::string found = words.empty() ? "none" : fmt::format("'{}'", words.front());
    return {fmt::format("expected a command, one of {}, found {}", known, found),
            CLI::ExitCodes::RequiredError};
}

// Before the work: no file that is written is named by two options, and each can be.
palpate::Result<void> expect_files(const Command& command, const std::string& trace) {
    std::vector<palpate::NamedFile> files = command.files();
    files.push_back({"--profile", trace, palpate::FileUse::write});
    palpate::Result<void> apart = palpate::each_its_own(files);
    return apart ? palpate::all_can_be_written(files) : apart;
}

} // namespace

int main(int argc, char** argv) {
    if (argc > 1 && std::string_view(argv[1]) == "__decode") // a child of load_volume()
        palpate::io::serve_decoding(argc, argv);
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

    std::vector<std::pair<CLI::App*, Command>> commands;
    for (const Entry& entry : kCommands) {
        CLI::App* sub = app.add_subcommand(entry.name, entry.purpose);
        sub->fallthrough();
        commands.emplace_back(sub, entry.add(*sub));
    }
    palpate::refuse_not_finite(app);
    const auto tell = [&](const CLI::Error& error) {
        std::ostringstream out, messages; // they quote the words of the command line
        const int code = app.exit(error, out, messages);
        std::cerr << palpate::printable_lines(messages.str());
        const palpate::Result<void> printed = palpate::print_text(out.str());
        return code != 0 ? 2 : printed ? 0 : 1;
    };
    try {
        app.parse(argc, argv);
    } catch (const CLI::RequiredError& error) {
        return tell(with_unknown_word(app, error));
    } catch (const CLI::ParseError& error) {
        return tell(error);
    }
    if (verbose)
        palpate::log::set_level(palpate::log::Level::debug);
    if (quiet)
        palpate::log::set_level(palpate::log::Level::error);
    try {
        for (auto& [sub, command] : commands)
            if (sub->parsed()) {
                palpate::Result<void> result = expect_files(command, trace);
                if (result)
                    result = profiled(command, trace);
                if (!result)
                    palpate::log::error("{}", result.error().message);
                else if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
                    palpate::log::error("standard output cannot be written");
                else
                    return 0;
                return 1;
            }
    } catch (const std::bad_alloc&) {
        palpate::log::error("out of memory");
    } catch (const std::exception& error) {
        palpate::log::error("{}", error.what());
    }
    return 1;
}
