#pragma once

#include <fstream>
#include <string>
#include <vector>

#include "tests/support/paths.h"

namespace palpate {

// The rows below a heading of a table of a page of ours; none where the page has no such heading.
inline std::vector<std::string> table_rows(const std::string& page, const std::string& heading) {
    std::ifstream in(kSourceDir + ("/" + page));
    std::vector<std::string> rows;
    bool in_table = false;
    for (std::string line; std::getline(in, line);) {
        if (in_table && !line.starts_with("|"))
            break;
        if (in_table && line.starts_with("| "))
            rows.push_back(line);
        in_table = in_table || line == heading;
    }
    return rows;
}

} // namespace palpate
