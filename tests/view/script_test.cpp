// Scripts of input.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "apps/view/script/script.h"

namespace palpate::view {
namespace {

using ::testing::HasSubstr;

Event random_event(std::mt19937& random) {
    const auto& keys = key_names();
    Event event;
    event.kind = static_cast<Event::Kind>(random() % 8);
    event.modifiers = {random() % 2 == 0, random() % 2 == 0, random() % 2 == 0};
    switch (event.kind) {
        case Event::Kind::move:
            event.at_px = {static_cast<double>(random() % 2000),
                           static_cast<double>(random() % 2000)};
            break;
        case Event::Kind::button:
            event.button = static_cast<Button>(random() % 3);
            event.down = random() % 2;
            break;
        case Event::Kind::wheel:
            event.wheel = {0.0, static_cast<double>(random() % 5) - 2.0};
            break;
        case Event::Kind::key:
            event.key = keys[random() % keys.size()];
            event.down = random() % 2;
            break;
        case Event::Kind::text:
            event.text = random() % 2 ? "ä\"\\" : "x";
            break;
        case Event::Kind::resize:
            event.size_px = {random() % 640, random() % 480};
            break;
        case Event::Kind::drop:
            event.paths = {"/a b/c.nii", "d"};
            break;
        case Event::Kind::close:
            break;
    }
    return event;
}

Place random_place(std::mt19937& random) {
    const auto number = [&] { return std::uniform_real_distribution<>(-300.0, 300.0)(random); };
    const Panel panel = kPanels[random() % kPanels.size()];
    switch (random() % 4) {
        case 0:
            return WidgetPlace{"tool/draw", {number(), number()}};
        case 1:
            return ViewPlace{panel, {number(), number()}};
        case 2:
            return PointPlace{panel, {number(), number(), number()}, random() % 2 == 0};
        default:
            return {};
    }
}

TEST(Script, WhatIsWrittenIsReadTheSame) {
    std::mt19937 random(21);
    Script script;
    script.size_px = {800, 600};
    script.text_scale = 1.5;
    std::string text = header_line(script.size_px, script.text_scale);
    uint64_t frame = 0;
    double time_s = 0.0;
    for (int i = 0; i < 2000; ++i) {
        Event event = random_event(random);
        event.time_s = time_s += 0.001 * static_cast<double>(random() % 100);
        const Place place = event.kind == Event::Kind::move ? random_place(random) : Place();
        if (!std::holds_alternative<std::monostate>(place))
            event.at_px = {}; // it is told by the place
        script.lines.push_back({frame += random() % 3, event, place});
        text += event_line(frame, event, place);
    }
    const Result<Script> read = parse_script(text, "s.jsonl");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->size_px, script.size_px);
    EXPECT_EQ(read->text_scale, 1.5);
    ASSERT_EQ(read->lines.size(), script.lines.size());
    for (size_t i = 0; i < script.lines.size(); ++i)
        EXPECT_EQ(read->lines[i], script.lines[i])
            << event_line(0, script.lines[i].event, script.lines[i].place);
}

TEST(Script, ErrorsNameTheLineAndWhatWasExpected) {
    const std::string head = "{\"palpate_view\": 1}\n";
    const auto error = [](const std::string& text) {
        const Result<Script> read = parse_script(text, "s.jsonl");
        return read ? std::string() : read.error().message;
    };
    EXPECT_THAT(error(""), HasSubstr("expected a header"));
    EXPECT_THAT(error("{\"size\": [640, 480]}"), HasSubstr("s.jsonl:1: expected a header"));
    EXPECT_THAT(error("{\"palpate_view\": 3}"),
                HasSubstr("s.jsonl:1: palpate_view: expected 1 or 2, a version of the format"));
    EXPECT_THAT(error(head + "{\"frame\": 1}"), HasSubstr("s.jsonl:2: expected one of \"move\""));
    EXPECT_THAT(error(head + "{\"move\": [1, 2]}"), HasSubstr("expected \"frame\""));
    EXPECT_THAT(error(head + "{\"frame\": 1, \"key\": \"any\"}"), HasSubstr("the name of a key"));
    EXPECT_THAT(error(head + "{\"frame\": 1, \"move\": [1]}"), HasSubstr("s.jsonl:2: move"));
    EXPECT_THAT(error(head + "{\"frame\": 1, \"move\": [1, 2], \"text\": \"a\"}"),
                HasSubstr("expected one of"));
    EXPECT_THAT(
        error(head + "{\"frame\": 2, \"text\": \"a\"}\n{\"frame\": 1, \"text\": \"a\"}"),
        HasSubstr("s.jsonl:3: expected \"frame\" to be at least 2, that of the line before, "
                  "found 1"));
    EXPECT_THAT(
        error(head + "{\"frame\": 2, \"t_s\": 0.75, \"text\": \"a\"}\n{\"frame\": 2, \"t_s\": "
                     "0.25, \"text\": \"a\"}"),
        HasSubstr("s.jsonl:3: expected \"t_s\" to be at least 0.75, that of the line before, "
                  "found 0.25"));
    EXPECT_THAT(
        error(head + "{\"frame\": 1, \"t_s\": 0.75, \"text\": \"a\"}\n"
                     "{\"frame\": 30, \"text\": \"a\"}"),
        HasSubstr("at least 0.75, that of the line before, found 0.5, of the frame's number"));
    for (const char* place :
         {R"({})", R"({"widget": "a"})", R"({"widget": "a", "mm": [1, 2, 3]})",
          R"({"widget": "a", "view": "3d", "share": [0, 0]})", R"({"view": "axial"})",
          R"({"view": "axial", "mm": [1, 2, 3], "share": [0, 0]})",
          R"({"view": "oblique", "share": [0, 0]})", R"({"view": "axial", "mm": [1, 2]})",
          R"({"view": "axial", "sample": [1, 2, 1e10]})", R"({"view": "axial", "at": [1, 2]})"})
        EXPECT_THAT(error(head + R"({"frame": 1, "move": )" + place + "}"), HasSubstr("s.jsonl:2:"))
            << place;
    EXPECT_THAT(error(head + "{\"frame\": 1, \"mov\": [1, 2]}"), HasSubstr("mov"));
    EXPECT_THAT(error(head + "{\"frame\": 1, \"resize\": [-1, 2]}"), HasSubstr("resize"));
    EXPECT_EQ(error(head + "\n  \n{\"frame\": 1, \"move\": [1, 2]}\n"), "");
}

TEST(Script, AFrameTakesARunOfMovesOrOneOtherEvent) {
    EventQueue queue;
    const auto push = [&](Event::Kind kind) { queue.push({.kind = kind}); };
    for (const Event::Kind kind : {Event::Kind::move, Event::Kind::move, Event::Kind::button,
                                   Event::Kind::button, Event::Kind::move, Event::Kind::key})
        push(kind);
    std::vector<size_t> counts;
    while (!queue.empty())
        counts.push_back(queue.take_frame().size());
    EXPECT_EQ(counts, (std::vector<size_t>{2, 1, 1, 1, 1}));
    EXPECT_TRUE(queue.take_frame().empty());
}

} // namespace
} // namespace palpate::view
