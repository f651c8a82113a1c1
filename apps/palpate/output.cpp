#include "apps/palpate/output.h"

#include <iostream>
#include <span>

#include "engine/base/file.h"
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

} // namespace palpate
