#include "engine/program/output.h"

#include <filesystem>
#include <iostream>
#include <span>

#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/base/printable.h"

namespace palpate {

namespace {

Result<void> print(const std::string& text) {
    if (!(std::cout << text << std::flush))
        return fail("standard output cannot be written");
    return {};
}

} // namespace

std::string report_text(const Json& report) {
    return printable_json(json_text(report));
}

Result<void> print_text(std::string_view text) {
    return print(printable_lines(text));
}

Result<void> print_report(std::string_view json) {
    return print(printable_json(json));
}

Result<void> write_text(const std::string& path, const std::string& text) {
    if (path.empty())
        return {};
    return path == "-" ? print_report(text) : save_bytes(path, std::as_bytes(std::span(text)));
}

void tell_made(const std::string& path, const std::string& what) {
    namespace fs = std::filesystem;
    std::error_code error;
    const auto size_of = [&](const fs::path& file) {
        return static_cast<double>(fs::file_size(FilesTogether::written(file), error));
    };
    double bytes = size_of(path);
    if (!error && fs::path(path).extension() == ".mhd")
        bytes += size_of(fs::path(path).replace_extension(".raw"));
    if (error)
        return;
    log::info("{}: {}, {}", path, what,
              bytes < 1e3   ? fmt::format("{:.0f} bytes", bytes)
              : bytes < 1e6 ? fmt::format("{:.1f} kB", bytes / 1e3)
                            : fmt::format("{:.1f} MB", bytes / 1e6));
}

void tell_made(const std::string& path, const Volume& volume) {
    const glm::uvec3 size = volume.size();
    tell_made(path, fmt::format("{} x {} x {} samples of {}", size.x, size.y, size.z,
                                name_of(volume.type())));
}

void warn_of_lost_inversion(const std::string& out, const std::string& from) {
    log::warning("{}: does not hold that small values are bright (MONOCHROME1 of {})", out, from);
}

} // namespace palpate
