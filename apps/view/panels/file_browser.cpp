#include "apps/view/panels/file_browser.h"

#include <algorithm>
#include <span>

#include "apps/view/window/settings.h"
#include "engine/base/file.h"
#include "engine/base/json.h"

namespace palpate::view {

namespace fs = std::filesystem;

Result<std::vector<BrowserEntry>> list_folder(const fs::path& folder) {
    std::error_code error;
    std::vector<BrowserEntry> entries;
    fs::directory_iterator it(folder, error);
    for (; !error && it != fs::directory_iterator(); it.increment(error)) {
        std::error_code ignored;
        BrowserEntry entry{it->path().filename().string(), it->is_directory(ignored), 0};
        if (entry.name.starts_with('.'))
            continue;
        if (!entry.is_folder)
            if (const uintmax_t bytes = it->file_size(ignored); !ignored)
                entry.bytes = bytes;
        entries.push_back(std::move(entry));
    }
    if (error)
        return fail("{}: cannot be read: {}", folder.string(), error.message());
    std::sort(entries.begin(), entries.end(), [](const BrowserEntry& a, const BrowserEntry& b) {
        return a.is_folder != b.is_folder ? a.is_folder : a.name < b.name;
    });
    return entries;
}

// "/a/./b/" and "/a/b" are one.
static std::string plain_path(const std::string& path) {
    const fs::path plain = fs::path(path).lexically_normal();
    return (plain.has_filename() || !plain.has_relative_path() ? plain : plain.parent_path())
        .string();
}

fs::path recent_file() {
    return state_file("recent.json");
}

std::vector<std::string> load_recent(const fs::path& file) {
    std::vector<std::string> paths;
    if (file.empty())
        return paths;
    const Result<std::string> text = load_text(file, 1 << 20);
    const Result<Json> json = text ? parse_json(*text, file.string()) : Result<Json>(fail("none"));
    if (!json || json->kind != Json::Kind::array)
        return paths;
    for (const Json& item : *json) {
        if (item.kind != Json::Kind::string || paths.size() == kMostRecent)
            continue;
        std::string path = plain_path(item.string);
        if (std::ranges::find(paths, path) == paths.end()) // older programs kept them as typed
            paths.push_back(std::move(path));
    }
    return paths;
}

Result<void> add_recent(const fs::path& file, const std::string& path) {
    if (file.empty())
        return {};
    std::vector<std::string> paths = load_recent(file);
    const std::string plain = plain_path(path);
    std::erase(paths, plain);
    paths.insert(paths.begin(), plain);
    paths.resize(std::min(paths.size(), kMostRecent));
    std::error_code error;
    fs::create_directories(file.parent_path(), error);
    const std::string text = json_text(Json(paths));
    return save_bytes(file, std::as_bytes(std::span(text)));
}

} // namespace palpate::view
