#include "bench/suite/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace palpate::bench {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class Page : public TemporaryFolder {};

TEST_F(Page, NeedsNothingBesideItself) {
    const std::string html = page_html(Json::array());
    for (const char* outside : {"http:", "https:", "//cdn", "@import", "src=\"", "<link", "url("})
        EXPECT_THAT(html, Not(HasSubstr(outside))) << outside;
    for (const char c : html)
        ASSERT_LT(static_cast<unsigned char>(c), 128); // whatever a server says the encoding is
    EXPECT_THAT(html, Not(HasSubstr("@RESULTS@")));
}

TEST_F(Page, ResultsCannotEndTheScriptTheyStandIn) {
    const Json evil{{"suite", "quality"}, {"note", "</script><script>alert(1)</script><!--"}};
    const std::string html = page_html(Json::array({evil}));
    EXPECT_THAT(html, Not(HasSubstr("</script><script>alert")));
    EXPECT_THAT(html, Not(HasSubstr("<!--")));
    // A browser's JSON.parse sees what was put in.
    const size_t from = html.find("id=\"results\">") + 13;
    const Result<Json> back =
        parse_json(html.substr(from, html.find("</script>", from) - from), "page");
    ASSERT_TRUE(back);
    EXPECT_EQ(back->items.at(0), evil);
}

TEST_F(Page, PutsPicturesInsideAndOnlyThoseOfItsFolder) {
    std::filesystem::create_directory(file("out"));
    std::filesystem::create_directory(file("out/maps"));
    write("secret.png", "secret");
    write("out/maps/a.png", std::string("\x00\xffpicture", 9));
    write("out/quality.json",
          json_text(
              {{"suite", "quality"},
               {"maps",
                {{{"png", "maps/a.png"}}, {{"png", "../secret.png"}}, {{"png", "gone.png"}}}}}));
    ASSERT_TRUE(write_page(file("out")));
    const std::string html = bytes_of("out/index.html");
    EXPECT_THAT(html, HasSubstr("data:image/png;base64,AP9waWN0dXJl")); // as base64(1) has it
    EXPECT_THAT(html, Not(HasSubstr("c2VjcmV0")));                      // "secret"
    EXPECT_THAT(html, HasSubstr("{\"png\": null}"));
}

TEST_F(Page, ShowsEverySuiteWhoseResultIsThere) {
    write("edit.json", R"({"suite": "edit", "title": "a dab", "rows": []})");
    write("frame.json", R"({"suite": "frame", "frames": []})");
    write("touch.json", R"({"suite": "touch", "touch": {}})");
    ASSERT_TRUE(write_page(file(".")));
    const std::string html = bytes_of("index.html");
    EXPECT_THAT(html, HasSubstr("\"suite\": \"edit\""));
    EXPECT_THAT(html, HasSubstr("\"suite\": \"touch\""));
    EXPECT_THAT(html, HasSubstr("\"suite\": \"frame\""));
    // The functions that draw them, and no place that is still to be filled.
    EXPECT_THAT(html, HasSubstr("function editSection("));
    EXPECT_THAT(html, HasSubstr("function touchSection("));
    EXPECT_THAT(html, Not(HasSubstr("@PARTS@")));
}

// The words of a result cannot take the place of anything else.
TEST_F(Page, NamesOfPlacesAreDataLikeAnyOther) {
    const std::string html =
        page_html(Json::array({Json{{"suite", "quality"}, {"note", "@PARTS@ @RESULTS@"}}}));
    EXPECT_THAT(html, HasSubstr("\"note\": \"@PARTS@ @RESULTS@\""));
}

TEST_F(Page, ADamagedResultIsOneSentence) {
    for (const char* text : {"", "{", "[]", "{\"suite\": \"upload\"}", "{\"suite\": 3}"}) {
        write("quality.json", text);
        const Result<void> written = write_page(file("."));
        ASSERT_FALSE(written) << text;
        EXPECT_THAT(written.error().message,
                    HasSubstr("quality.json: expected the result of palpate bench quality"));
    }
    EXPECT_FALSE(std::filesystem::exists(file("index.html")));
}

} // namespace
} // namespace palpate::bench
