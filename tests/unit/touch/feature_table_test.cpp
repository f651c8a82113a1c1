// docs/reference/touch.md has a row for each of the 25 features of the papers, and the tests it
// names exist.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "tests/support/paths.h"

namespace palpate {
namespace {

std::string text_of(const std::filesystem::path& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
}

// "Suite.Test" of every test in the sources, and "Suite.*" of every suite.
std::set<std::string> all_tests() {
    std::set<std::string> names;
    const std::regex test(R"(\nTEST(?:_P|_F)?\((\w+),\s*(\w+)\))");
    for (const auto& entry : std::filesystem::recursive_directory_iterator(
             std::filesystem::path(kSourceDir) / "tests")) {
        if (entry.path().extension() != ".cpp")
            continue;
        const std::string text = text_of(entry.path());
        for (std::sregex_iterator it(text.begin(), text.end(), test), end; it != end; ++it) {
            names.insert((*it)[1].str() + "." + (*it)[2].str());
            names.insert((*it)[1].str() + ".*");
        }
    }
    return names;
}

TEST(FeatureTable, HasARowForEachFeatureAndItsTestsExist) {
    const std::set<std::string> tests = all_tests();
    ASSERT_GT(tests.size(), 500u);
    std::istringstream page(
        text_of(std::filesystem::path(kSourceDir) / "docs" / "reference" / "touch.md"));
    const std::regex row(R"(\| F(\d+) \|.*\|([^|]*)\|)");
    const std::regex named(R"(`([A-Z]\w*\.(?:\w+|\*))`)");
    int next = 1;
    for (std::string line; std::getline(page, line);) {
        std::smatch found;
        if (!std::regex_match(line, found, row))
            continue;
        EXPECT_EQ(std::stoi(found[1]), next) << line;
        const std::string cell = found[2];
        int count = 0;
        for (std::sregex_iterator it(cell.begin(), cell.end(), named), end; it != end; ++it) {
            EXPECT_TRUE(tests.count((*it)[1])) << "F" << next << ": no test " << (*it)[1];
            ++count;
        }
        EXPECT_GT(count, 0) << "F" << next << " names no test";
        ++next;
    }
    EXPECT_EQ(next, 26);
}

} // namespace
} // namespace palpate
