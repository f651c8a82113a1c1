// The table of tools, and what is made from it.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "apps/view/tools/tool.h"
#include "apps/view/window/keys.h"
#include "tests/support/paths.h"
#include "tests/view/subjects.h"

namespace palpate::view {
namespace {

TEST(Tools, HaveNamesAndKeysOfTheirOwn) {
    std::set<std::string> names, keys;
    for (const Tool* tool : tools()) {
        EXPECT_TRUE(names.insert(tool->name).second) << tool->name;
        EXPECT_TRUE(!tool->key || keys.insert(tool->key).second) << tool->name;
        EXPECT_FALSE(std::string(tool->help).empty()) << tool->name;
    }
}

// Buttons of a group stand side by side, each with an icon of its own that the window has, or with
// letters of its own.
TEST(Tools, HaveIconsInGroups) {
    std::set<Icon> icons;
    std::set<std::string> letters;
    std::vector<ToolGroup> groups;
    for (const Tool* tool : tools()) {
        if (!tool->title)
            continue;
        groups.push_back(tool->group);
        if (tool->icon == Icon::none) {
            EXPECT_TRUE(letters.insert(std::string(tool->title).substr(0, 2)).second) << tool->name;
            continue;
        }
        EXPECT_TRUE(icons.insert(tool->icon).second) << tool->name;
        EXPECT_NE(std::find(std::begin(kIcons), std::end(kIcons), tool->icon), std::end(kIcons))
            << tool->name;
    }
    EXPECT_TRUE(std::is_sorted(groups.begin(), groups.end()));
}

// The key of a tool changes what the tool's own functions change, the tool, and the hand's button.
TEST(Tools, AKeyTakesItsTool) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    for (const Tool* tool : tools()) {
        if (!tool->key)
            continue;
        TestHand hand{subject};
        hand.state.stylus.first = Carve::drill;
        ViewState expected = hand.state;
        expected.tool = tool;
        expected.stylus.first = tool->first_button.value_or(Carve::drill);
        hand.key(tool->key);
        EXPECT_EQ(hand.state, expected) << tool->name;
        EXPECT_TRUE(hand.orders.empty()) << tool->name;
    }
}

// Whatever tool is in the hand: the right button zooms, and a drag of the left one ends with its
// release or with Escape.
TEST(Tools, LetTheirDragsEnd) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    for (const Tool* tool : tools())
        for (const Panel panel : kPanels)
            for (const bool escapes : {false, true}) {
                TestHand hand{subject};
                hand.state.tool = tool;
                const glm::dvec2 at = hand.middle(panel) + glm::dvec2(21, 13);
                hand.move(at);
                hand.press(Button::left);
                hand.move(at + glm::dvec2(15, 5));
                if (escapes)
                    hand.key("escape");
                else
                    hand.release(Button::left);
                EXPECT_FALSE(hand.state.drag) << tool->name;
                EXPECT_EQ(hand.state.tool, tool);
            }
}

TEST(Tools, StatesAreComparedAsValues) {
    struct Count {
        int of = 0;
        bool operator==(const Count&) const = default;
    };
    struct Name {
        std::string is;
        bool operator==(const Name&) const = default;
    };
    ToolStates a, b;
    EXPECT_EQ(a, b);
    a.of<Count>();
    EXPECT_EQ(a, b) << "an untouched state is one that was never asked for";
    a.of<Count>().of = 3;
    EXPECT_NE(a, b);
    EXPECT_NE(b, a);
    b = a;
    EXPECT_EQ(a, b);
    b.of<Name>().is = "b";
    EXPECT_NE(a, b);
    EXPECT_NE(b, a);
    EXPECT_EQ(std::as_const(b).of<Count>().of, 3);
    EXPECT_EQ(std::as_const(a).of<Name>().is, "");
}

TEST(KeyHelp, IsTheTableOfTheGuide) {
    std::ifstream in(std::string(kSourceDir) + "/docs/guide/view.md");
    ASSERT_TRUE(in);
    std::vector<std::string> rows;
    bool in_table = false;
    for (std::string line; std::getline(in, line);) {
        if (in_table && line.rfind("| ", 0) != 0 && line.rfind("|-", 0) != 0)
            break;
        if (in_table && line.rfind("| ", 0) == 0)
            rows.push_back(line);
        in_table = in_table || line == "| mouse and keys | |";
    }
    std::vector<std::string> expected;
    for (const KeyHelp& line : key_help())
        expected.push_back(fmt::format("| {} | {} |", line.keys, line.purpose));
    EXPECT_EQ(rows, expected) << "the table below \"## Mouse and keys\" in docs/guide/view.md";
}

} // namespace
} // namespace palpate::view
