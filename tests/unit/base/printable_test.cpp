#include "engine/base/printable.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace palpate {
namespace {

TEST(Printable, ControlCharactersAreShownAsTheyAreWritten) {
    EXPECT_EQ(printable("a\x1b[2J\x07\x7f"), "a\\x1b[2J\\x07\\x7f");
    EXPECT_EQ(printable("one\ntwo\r\tthree"), "one\\ntwo\\r\\tthree");
    EXPECT_EQ(printable(std::string_view("\0", 1)), "\\x00");
    EXPECT_EQ(printable("\xc2\x9b"
                        "31m"),
              "\\x9b31m"); // the control sequence introducer as one character
    EXPECT_EQ(printable_lines("one\ntwo\x1b\n"), "one\ntwo\\x1b\n");
}

TEST(Printable, TextStaysReadable) {
    const std::string text = "Kopf-Größe 3 µm, 頭部, 🦴, C:\\ct\\a.nii \"quoted\"";
    EXPECT_EQ(printable(text), text);
    EXPECT_EQ(printable_lines(text), text);
    EXPECT_EQ(printable_json(text), text);
    EXPECT_EQ(printable(""), "");
}

TEST(Printable, WhatIsNoUtf8IsShownByteByByte) {
    EXPECT_EQ(printable("\xff\x80z"), "\\xff\\x80z");
    EXPECT_EQ(printable("\xc3"), "\\xc3");          // cut
    EXPECT_EQ(printable("\xc0\x9b"), "\\xc0\\x9b"); // overlong
    EXPECT_EQ(printable("\xe0\x80\x9b"), "\\xe0\\x80\\x9b");
    EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80"); // a surrogate
    EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
}

TEST(Printable, TextThatTurnsTheDirectionIsShown) {
    EXPECT_EQ(printable("a\u202e"
                        "b\u2066c\u2028"),
              "a\\u202eb\\u2066c\\u2028");
}

TEST(Printable, JsonSaysTheSame) {
    const nlohmann::json json{{"name\x7f",
                               "\xc2\x9b"
                               "31m \u202e \x1b \n ü"},
                              {"n", {1, 2}}};
    const std::string text = printable_json(json.dump(2));
    EXPECT_EQ(nlohmann::json::parse(text), json);
    for (const char* raw : {"\x7f", "\xc2\x9b", "\u202e", "\x1b"})
        EXPECT_EQ(text.find(raw), std::string::npos);
    EXPECT_NE(text.find("ü"), std::string::npos);
}

} // namespace
} // namespace palpate
