#include "engine/page/page_of.h"

#include "engine/page/page_template.h"

namespace palpate {

std::string page_of(std::string_view script, const Json& results) {
    // "</script" and "<!--" must not appear inside a script element.
    std::string data;
    for (const char c : json_line(results))
        data += c == '<' ? std::string("\\u003c") : std::string(1, c);
    std::string page = kPageTemplate;
    const auto put = [&](std::string_view place, const std::string& text) {
        page.replace(page.find(place), place.size(), text);
    };
    put("@SCRIPT@", std::string(script));
    put("@RESULTS@", data); // last: it may hold any text
    return page;
}

} // namespace palpate
