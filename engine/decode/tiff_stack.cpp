#include "engine/decode/tiff_stack.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "engine/decode/length_units.h"
#include "engine/decode/tiff_file.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace {

constexpr uint32_t kDescription = 270, kXResolution = 282, kYResolution = 283, kUnit = 296;
constexpr uint32_t kCompression = 259, kStripOffsets = 273, kStripByteCounts = 279;

using Keys = std::map<std::string, std::string, std::less<>>;

// Lines of "key=value".
Keys keys_of(std::string_view text) {
    Keys keys;
    while (!text.empty()) {
        std::string_view line = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(text.size(), line.size() + 1));
        if (const size_t equals = line.find('='); equals != line.npos)
            keys.emplace(trimmed(line.substr(0, equals)), trimmed(line.substr(equals + 1)));
    }
    return keys;
}

std::string_view value(const Keys& keys, std::string_view key) {
    const auto found = keys.find(key);
    return found == keys.end() ? std::string_view() : std::string_view(found->second);
}

uint64_t count_of(const Keys& keys, std::string_view key) {
    const std::optional<int64_t> count = parse_integer(value(keys, key));
    return count && *count > 0 && *count <= INT32_MAX ? static_cast<uint64_t>(*count) : 0;
}

std::optional<double> number_of(const Keys& keys, std::string_view key) {
    const std::optional<double> number = parse_double(value(keys, key));
    return number && std::isfinite(*number) ? number : std::nullopt;
}

// Millimetres in a unit of ImageJ's; a unit that is no length counts as millimetres.
double unit_in_mm(const std::string& name, std::string_view unit,
                  std::vector<std::string>& warnings) {
    const std::optional<double> mm = length_in_mm(unit);
    if (!mm)
        warnings.push_back(
            fmt::format("{}: expected a unit of length, found \"{}\"; mm are assumed", name,
                        unit.substr(0, 40)));
    return mm.value_or(1);
}

std::optional<glm::dvec3> imagej_spacing(const std::string& name, const Keys& keys,
                                         const ImageJResolution& resolution, uint32_t slices,
                                         std::vector<std::string>& warnings) {
    std::string_view unit = value(keys, "unit");
    if (unit.empty())
        unit = resolution.unit;
    if (unit.empty() || lower_case(unit).starts_with("pixel") || !resolution.x || !resolution.y)
        return {};
    const double mm = unit_in_mm(name, unit, warnings);
    const auto of = [&](std::string_view key) { // y and z may have units of their own
        const std::string_view own = value(keys, key);
        return own.empty() || own == unit ? mm : unit_in_mm(name, own, warnings);
    };
    const std::optional<double> depth = number_of(keys, "spacing");
    if (slices > 1 && (!depth || *depth == 0))
        warnings.push_back(fmt::format(
            "{}: does not state the distance between its slices; 1 {} is assumed", name, unit));
    return glm::dvec3(mm / *resolution.x, of("yunit") / *resolution.y,
                      of("zunit") * (depth && *depth != 0 ? std::abs(*depth) : 1.0));
}

} // namespace

bool TiffStack::is_plain(uint32_t found_pages) const {
    std::vector<uint32_t> in_order(found_pages);
    std::iota(in_order.begin(), in_order.end(), 0u);
    return pages == in_order && slices == found_pages;
}

std::string TiffStack::words() const {
    const auto several = [](uint32_t count, const char* what) {
        return count > 1 ? fmt::format("{} {}", count, what) : std::string();
    };
    const std::string c = several(channels, "channels"), t = several(times, "times");
    return c + (c.empty() || t.empty() ? "" : " and ") + t;
}

// Pages follow one another by channel, then slice, then time.
std::optional<TiffStack> imagej_stack(const std::string& name, const std::string& description,
                                      const ImageJResolution& resolution, uint32_t found_pages,
                                      std::vector<std::string>& warnings) {
    const Keys keys = keys_of(description);
    TiffStack stack;
    const uint64_t images = std::max<uint64_t>(count_of(keys, "images"), 1);
    const uint64_t c = std::max<uint64_t>(count_of(keys, "channels"), 1);
    const uint64_t t = std::max<uint64_t>(count_of(keys, "frames"), 1);
    uint64_t z = count_of(keys, "slices");
    if (z == 0) // left out where it is 1, and of a stack that is no hyperstack
        z = images % (c * t) == 0 ? std::max<uint64_t>(images / (c * t), 1) : 1;
    const uint64_t all = z * c > INT32_MAX ? z * c : z * c * t; // below 2^63
    const bool one_page = found_pages == 1 && images > 1 && images == all;
    if (all != found_pages && !one_page) {
        warnings.push_back(fmt::format(
            "{}: ImageJ's description states {} slices, {} channels and {} times, but the file "
            "has {} pages; each is read as a slice",
            name, z, c, t, found_pages));
        stack.slices = found_pages;
        stack.pages.resize(found_pages);
        std::iota(stack.pages.begin(), stack.pages.end(), 0u);
    } else {
        stack.slices = static_cast<uint32_t>(z);
        stack.channels = static_cast<uint32_t>(c);
        stack.times = static_cast<uint32_t>(t);
        if (one_page)
            stack.raw_from = 0; // filled in by who knows the tags
        else
            for (uint32_t time = 0; time < t; ++time)
                for (uint32_t channel = 0; channel < c; ++channel)
                    for (uint32_t slice = 0; slice < z; ++slice)
                        stack.pages.push_back(channel +
                                              stack.channels * (slice + stack.slices * time));
    }
    stack.spacing_mm = imagej_spacing(name, keys, resolution, stack.slices, warnings);
    const std::optional<double> c0 = number_of(keys, "c0"), c1 = number_of(keys, "c1");
    if (value(keys, "cf") == "0" && c0 && c1 && *c1 != 0) // a straight line
        stack.rescale = Rescale{*c1, *c0};
    return stack;
}

Result<std::optional<TiffStack>> read_tiff_stack(const std::filesystem::path& path,
                                                 uint32_t found_pages,
                                                 std::vector<std::string>& warnings) {
    PALPATE_TRY(TiffFile file, TiffFile::open(path));
    PALPATE_TRY(const TiffDirectory page, file.directory(file.first_directory()));
    PALPATE_TRY(const std::string description,
                file.text(page, kDescription, "the description of its first page"));
    const std::string name = path.string();
    if (description.find("<OME") != std::string::npos ||
        description.find(":OME ") != std::string::npos)
        return ome_stack(path, description, found_pages, warnings);
    if (!description.starts_with("ImageJ="))
        return std::optional<TiffStack>();
    ImageJResolution resolution;
    PALPATE_TRY(resolution.x, file.rational(page, kXResolution, "its pixels a unit"));
    PALPATE_TRY(resolution.y, file.rational(page, kYResolution, "its pixels a unit"));
    PALPATE_TRY(const std::vector<uint64_t> unit,
                file.numbers(page, kUnit, "the unit of its resolution"));
    // 72 pixels an inch stand for "not known".
    if (unit == std::vector<uint64_t>{2} && resolution.x != 72.0)
        resolution.unit = "inch";
    else if (unit == std::vector<uint64_t>{3})
        resolution.unit = "cm";
    std::optional<TiffStack> stack =
        imagej_stack(name, description, resolution, found_pages, warnings);
    if (!stack || !stack->raw_from)
        return stack;
    PALPATE_TRY(const std::vector<uint64_t> packed,
                file.numbers(page, kCompression, "its compression"));
    PALPATE_TRY(const std::vector<uint64_t> at,
                file.numbers(page, kStripOffsets, "the places of its pixels"));
    PALPATE_TRY(const std::vector<uint64_t> sizes,
                file.numbers(page, kStripByteCounts, "the sizes of its pixels"));
    const uint64_t one = std::accumulate(sizes.begin(), sizes.end(), uint64_t{0});
    const uint64_t images = uint64_t{stack->frames()} * stack->slices;
    const bool is_raw = (packed.empty() || packed.front() == 1) && !at.empty() && one > 0;
    // The tags of one page that was taken out of a stack lie where others' pixels would.
    const uint64_t from = is_raw ? at.front() : 0, directory = file.first_directory();
    const bool has_room = is_raw && (file.bytes() - std::min(file.bytes(), from)) / one >= images &&
                          (directory < from || directory >= from + images * one);
    if (has_room) {
        stack->raw_from = from;
        stack->big_endian = file.is_big_endian();
        return stack;
    }
    warnings.push_back(fmt::format(
        "{}: ImageJ's description states {} images, but the file has one page, which is read", name,
        images));
    TiffStack single;
    single.pages = {0};
    single.spacing_mm = stack->spacing_mm;
    single.rescale = stack->rescale;
    return std::optional(single);
}

} // namespace palpate::io
