#include "bench/suite/page.h"

#include <algorithm>
#include <utility>

#include "bench/suite/page_edit.h"
#include "bench/suite/page_segment.h"
#include "bench/suite/page_suites.h"
#include "bench/suite/page_touch.h"
#include "engine/base/file.h"
#include "engine/page/page_of.h"

namespace palpate::bench {

namespace {

namespace fs = std::filesystem;

std::string base64(std::string_view bytes) {
    constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        const size_t left = std::min<size_t>(3, bytes.size() - i);
        uint32_t word = 0;
        for (size_t k = 0; k < 3; ++k)
            word = word << 8 | (k < left ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (size_t k = 0; k < 4; ++k)
            text += k <= left ? kDigits[word >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

// Replaces each "png" that names a file by the picture itself. Names that leave the folder, and
// files that are not there, lose their picture.
void put_pictures_inside(Json& value, const fs::path& folder) {
    if (value.contains("png") && value["png"].kind == Json::Kind::string) {
        const fs::path name = value["png"].string;
        const bool inside =
            name.is_relative() && name.lexically_normal().native().rfind("..", 0) != 0;
        const Result<std::string> bytes =
            inside ? load_text(folder / name) : fail("{}: not below the folder", name.string());
        value["png"] = bytes ? Json("data:image/png;base64," + base64(*bytes)) : Json();
    }
    for (Json& item : value.items)
        put_pictures_inside(item, folder);
    for (auto& [key, member] : value.members)
        put_pictures_inside(member, folder);
}

} // namespace

std::string page_html(const Json& results) {
    return page_of(std::string(kPageTouch) + kPageEdit + kPageSegment + kPageSuites, results);
}

Result<void> write_page(const fs::path& folder) {
    Json results = Json::array();
    for (const char* suite : {"quality", "render", "frame", "stability", "upload", "touch", "edit",
                              "surface", "segment"}) {
        const fs::path path = folder / fmt::format("{}.json", suite);
        if (!fs::exists(path))
            continue;
        PALPATE_TRY(const std::string text, load_text(path));
        Result<Json> result = parse_json(text, path.string());
        if (!result || std::as_const(*result)["suite"] != suite)
            return fail("{}: expected the result of palpate bench {}", path.string(), suite);
        put_pictures_inside(*result, folder);
        results.push_back(std::move(*result));
    }
    const std::string html = page_html(results);
    return save_bytes(folder / "index.html", std::as_bytes(std::span(html)));
}

} // namespace palpate::bench
