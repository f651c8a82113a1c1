#include "apps/palpate/output.h"

#include <iostream>

#include "engine/base/printable.h"

namespace palpate {

namespace {

Result<void> print(const std::string& text) {
    if (!(std::cout << text << std::flush))
        return fail("standard output cannot be written");
    return {};
}

} // namespace

std::string report_text(const nlohmann::ordered_json& report) {
    return printable_json(
               report.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace)) +
           "\n";
}

Result<void> print_text(std::string_view text) {
    return print(printable_lines(text));
}

Result<void> print_report(std::string_view json) {
    return print(printable_json(json));
}

} // namespace palpate
