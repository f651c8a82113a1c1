#include "apps/view/panels/file_browser.h"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
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
        if (const auto modified = it->last_write_time(ignored); !ignored)
            entry.modified_s = std::chrono::duration_cast<std::chrono::seconds>(
                                   std::chrono::file_clock::to_sys(modified).time_since_epoch())
                                   .count();
        if (!entry.is_folder)
            if (const uintmax_t bytes = it->file_size(ignored); !ignored)
                entry.bytes = bytes;
        entries.push_back(std::move(entry));
    }
    if (error)
        return fail("{}: cannot be read: {}", folder.string(), error.message());
    sort_entries(entries, EntryOrder::name, false);
    return entries;
}

// "2.nii" before "10.nii": digits that follow each other are a number; of equal ones the bytes.
static bool is_before(const std::string& a, const std::string& b) {
    const auto is_digit = [](char letter) {
        return std::isdigit(static_cast<unsigned char>(letter)) != 0;
    };
    const auto number_end = [&](const std::string& text, size_t from) {
        return static_cast<size_t>(
            std::find_if_not(text.begin() + static_cast<ptrdiff_t>(from), text.end(), is_digit) -
            text.begin());
    };
    size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        if (!is_digit(a[i]) || !is_digit(b[j])) {
            if (a[i] != b[j])
                return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
            ++i, ++j;
            continue;
        }
        const size_t a_end = number_end(a, i), b_end = number_end(b, j);
        const size_t a_begin = std::min(a.find_first_not_of('0', i), a_end),
                     b_begin = std::min(b.find_first_not_of('0', j), b_end);
        if (a_end - a_begin != b_end - b_begin)
            return a_end - a_begin < b_end - b_begin;
        if (const int order = a.compare(a_begin, a_end - a_begin, b, b_begin, b_end - b_begin))
            return order < 0;
        i = a_end;
        j = b_end;
    }
    return a.size() - i != b.size() - j ? a.size() - i < b.size() - j : a < b;
}

void sort_entries(std::vector<BrowserEntry>& entries, EntryOrder order, bool falls) {
    const auto less = [&](const BrowserEntry& a, const BrowserEntry& b) {
        switch (order) {
            case EntryOrder::size:
                if (a.bytes != b.bytes)
                    return a.bytes < b.bytes;
                break;
            case EntryOrder::date:
                if (a.modified_s != b.modified_s)
                    return a.modified_s < b.modified_s;
                break;
            case EntryOrder::name:
                break;
        }
        return is_before(a.name, b.name);
    };
    std::sort(entries.begin(), entries.end(), [&](const BrowserEntry& a, const BrowserEntry& b) {
        return a.is_folder != b.is_folder ? a.is_folder : falls ? less(b, a) : less(a, b);
    });
}

static std::string lower_case(std::string text) {
    for (char& letter : text)
        letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    return text;
}

bool may_be_opened(const std::string& name) {
    static constexpr std::array kEndings{".nii",  ".hdr",     ".img",   ".gz",  ".nrrd", ".nhdr",
                                         ".mha",  ".mhd",     ".vtk",   ".vti", ".mgh",  ".mgz",
                                         ".pbv",  ".inv3",    ".dcm",   ".ima", ".tif",  ".tiff",
                                         ".json", ".palpate", ".dicom", ".acr"};
    // Names without an ending that are no image's.
    static constexpr std::array kTexts{"sha256sums", "sha512sums", "sha1sums", "md5sums",
                                       "readme",     "license",    "licence",  "copying",
                                       "changelog",  "authors",    "makefile"};
    if (std::ranges::find(kTexts, lower_case(name)) != kTexts.end())
        return false;
    const std::string ending = lower_case(fs::path(name).extension());
    return std::all_of(ending.begin() + !ending.empty(), ending.end(),
                       [](unsigned char letter) { return std::isdigit(letter); }) ||
           std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

size_t count_pictures(const std::vector<BrowserEntry>& entries) {
    static constexpr std::array kPictures{".png", ".jpg", ".jpeg", ".bmp"};
    return static_cast<size_t>(std::ranges::count_if(entries, [](const BrowserEntry& one) {
        const std::string ending = lower_case(fs::path(one.name).extension());
        return !one.is_folder && std::ranges::find(kPictures, ending) != kPictures.end();
    }));
}

std::vector<size_t> listed_entries(const std::vector<BrowserEntry>& entries,
                                   const std::string& part, bool all_files) {
    const std::string sought = lower_case(part);
    std::vector<size_t> listed;
    for (size_t i = 0; i < entries.size(); ++i)
        if ((entries[i].is_folder || all_files || may_be_opened(entries[i].name)) &&
            lower_case(entries[i].name).find(sought) != std::string::npos)
            listed.push_back(i);
    return listed;
}

// The number of the file system that a folder lies in; 0: none.
static uint64_t file_system_of(const fs::path& folder) {
    struct stat status {};
    return ::stat(folder.c_str(), &status) == 0 ? status.st_dev : 0;
}

std::vector<BrowserPlace> browser_places(const fs::path& home,
                                         const std::vector<std::string>& recent,
                                         const std::vector<fs::path>& mounts) {
    std::vector<BrowserPlace> places;
    const auto add = [&](std::string name, const fs::path& folder) {
        std::error_code ignored;
        if (folder.is_absolute() && fs::is_directory(folder, ignored) &&
            std::none_of(places.begin(), places.end(),
                         [&](const BrowserPlace& one) { return one.folder == folder; }))
            places.push_back({std::move(name), folder});
    };
    add("home", home);
    for (const std::string& path : recent)
        if (const fs::path folder = fs::path(path).parent_path(); !folder.empty())
            add(folder.has_filename() ? folder.filename().string() : folder.string(), folder);
    for (const fs::path& root : mounts) {
        const Result<std::vector<BrowserEntry>> disks = list_folder(root);
        if (!disks)
            continue;
        for (const BrowserEntry& disk : *disks)
            if (disk.is_folder && file_system_of(root / disk.name) != file_system_of(root))
                add(disk.name, root / disk.name);
    }
    return places;
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
