// The table of docs/benchmarks/tasks.md: the column of this program is what its sessions count.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "apps/view/script/script.h"
#include "tests/support/paths.h"

namespace palpate::view {
namespace {

namespace fs = std::filesystem;

// Counts what a person does in a session, by the rules of the page: a press, a key or chord, a turn
// of the wheel, and a text with the key that ends it are one each. A key that is held while another
// thing is done makes one with it.
int presses_of(const Script& script) {
    int count = 0;
    bool text_ends = false, wheel_goes_on = false;
    std::map<std::string, bool> held; // keys that are down, and whether they were made one with
    for (const Script::Line& line : script.lines) {
        const Event& event = line.event;
        const bool is_key = event.kind == Event::Kind::key;
        // A window is closed by a press of its button.
        const bool is_press =
            (event.kind == Event::Kind::button && event.down) || event.kind == Event::Kind::close;
        if (is_press || event.kind == Event::Kind::wheel || (is_key && event.down)) {
            for (auto& [key, joined] : held)
                joined = true;
        }
        if (is_press)
            ++count;
        else if (event.kind == Event::Kind::wheel)
            count += !std::exchange(wheel_goes_on, true);
        else if (event.kind == Event::Kind::text)
            count += !std::exchange(text_ends, true);
        else if (is_key && event.down)
            held[event.key] = text_ends && (event.key == "enter" || event.key == "tab");
        else if (is_key)
            count += !held.extract(event.key).mapped();
        if (event.kind != Event::Kind::wheel && event.kind != Event::Kind::move)
            wheel_goes_on = false;
        if (event.kind != Event::Kind::text && !(is_key && event.down))
            text_ends = text_ends && event.kind == Event::Kind::move;
    }
    return count;
}

int presses_of(const std::string& lines) {
    return presses_of(
        parse_script("{\"palpate_view\": 2, \"size\": [800, 600]}\n" + lines, "s").value());
}

TEST(TaskCounts, FollowTheRulesOfThePage) {
    EXPECT_EQ(presses_of(R"({"frame": 1, "move": {"view": "axial", "share": [0.5, 0.5]}})"), 0);
    const std::string press = R"({"frame": 1, "button": "left", "down": true})"
                              "\n"
                              R"({"frame": 2, "button": "left"})"
                              "\n";
    EXPECT_EQ(presses_of(press), 1);
    EXPECT_EQ(presses_of(press + R"({"frame": 3, "button": "left", "down": true})"), 2); // a double
    const std::string w = R"({"frame": 1, "key": "w", "down": true})"
                          "\n",
                      w_up =
                          "\n"
                          R"({"frame": 9, "key": "w"})";
    EXPECT_EQ(presses_of(w + w_up), 1);
    EXPECT_EQ(presses_of(w + press + w_up), 1); // held during a drag
    EXPECT_EQ(presses_of(R"({"frame": 1, "key": "o", "down": true, "ctrl": true}
{"frame": 2, "key": "o", "ctrl": true}
{"frame": 3, "text": "head"}
{"frame": 4, "key": "enter", "down": true}
{"frame": 5, "key": "enter"}
{"frame": 6, "key": "enter", "down": true}
{"frame": 7, "key": "enter"})"),
              3); // a chord, a text with its key, and a key
    EXPECT_EQ(presses_of(R"({"frame": 1, "wheel": [0, 1]}
{"frame": 2, "wheel": [0, 1]})"),
              1);
}

// A row of the table of counts: its number, and what stands in its columns.
struct Row {
    int number;
    std::vector<std::string> columns;
};

std::string page() {
    std::ifstream in(fs::path(kSourceDir) / "docs/benchmarks/tasks.md");
    return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<Row> rows() {
    std::istringstream in(page());
    std::vector<Row> rows;
    bool counts = false;
    for (std::string line; std::getline(in, line);) {
        counts = counts || line.starts_with("| row | Palpate");
        if (!counts || !line.starts_with("| "))
            continue;
        std::istringstream cells(line.substr(1));
        Row row{0, {}};
        for (std::string cell; std::getline(cells, cell, '|');) {
            const size_t from = cell.find_first_not_of(' '), to = cell.find_last_not_of(' ');
            row.columns.push_back(from == cell.npos ? "" : cell.substr(from, to - from + 1));
        }
        row.number = std::atoi(row.columns.front().c_str());
        if (row.number > 0)
            rows.push_back(std::move(row));
    }
    return rows;
}

// The number of a column; none: the program cannot, or it is not known.
std::optional<int> number_in(const std::string& column) {
    return !column.empty() && std::isdigit(static_cast<unsigned char>(column[0]))
               ? std::optional(std::atoi(column.c_str()))
               : std::nullopt;
}

std::map<int, fs::path> sessions() {
    std::map<int, fs::path> found;
    for (const auto& entry : fs::directory_iterator(fs::path(kSourceDir) / "tests/view/tasks")) {
        if (!entry.is_regular_file()) // "start" has what is done before a session
            continue;
        const int row = std::atoi(entry.path().filename().c_str());
        EXPECT_TRUE(found.emplace(row, entry.path()).second) << entry.path();
    }
    return found;
}

TEST(TaskCounts, AreThoseOfThePage) {
    const std::map<int, fs::path> played = sessions();
    const std::vector<Row> table = rows();
    ASSERT_EQ(table.size(), 50u);
    for (const Row& row : table) {
        const auto session = played.find(row.number);
        if (session == played.end()) {
            EXPECT_EQ(row.columns[1], "") << "row " << row.number << " has no session";
            continue;
        }
        const Result<Script> script = load_script(session->second);
        ASSERT_TRUE(script) << script.error().message;
        EXPECT_EQ(number_in(row.columns[1]).value_or(-1), presses_of(*script))
            << "row " << row.number;
    }
}

} // namespace
} // namespace palpate::view
