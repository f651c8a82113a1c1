#include <algorithm>
#include <cmath>
#include <set>

#include <pugixml.hpp>

#include "engine/decode/length_units.h"
#include "engine/decode/tiff_stack.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace {

// "OME:Pixels" and "Pixels" are one: the prefix of a name space is the writer's choice.
std::string_view local_name(const pugi::xml_node& node) {
    const std::string_view name = node.name();
    const size_t colon = name.find(':');
    return colon == name.npos ? name : name.substr(colon + 1);
}

std::vector<pugi::xml_node> children(const pugi::xml_node& node, std::string_view name) {
    std::vector<pugi::xml_node> found;
    for (const pugi::xml_node child : node.children())
        if (local_name(child) == name)
            found.push_back(child);
    return found;
}

// A whole number 0 .. 2^31 - 1 of an attribute; `otherwise` where there is none. Absent where it is
// none of these.
std::optional<uint64_t> whole(const pugi::xml_node& node, const char* attribute,
                              uint64_t otherwise) {
    const pugi::xml_attribute found = node.attribute(attribute);
    if (!found)
        return otherwise;
    const std::optional<int64_t> number = parse_integer(found.value());
    if (!number || *number < 0 || *number > INT32_MAX)
        return {};
    return static_cast<uint64_t>(*number);
}

std::optional<double> length_mm(const std::string& name, const pugi::xml_node& pixels, char axis,
                                std::vector<std::string>& warnings) {
    const std::string key = std::string("PhysicalSize") + axis;
    const std::optional<double> size = parse_double(pixels.attribute(key.c_str()).value());
    if (!size || !std::isfinite(*size) || !(*size > 0))
        return {};
    const std::string unit = pixels.attribute((key + "Unit").c_str()).as_string("um");
    if (unit == "pixel" || unit == "reference frame")
        return {}; // no length
    const std::optional<double> mm = length_in_mm(unit);
    if (!mm)
        warnings.push_back(
            fmt::format("{}: expected a unit of length in {}Unit, found \"{}\"; um "
                        "are assumed",
                        name, key, unit.substr(0, 40)));
    return *size * mm.value_or(1e-3);
}

// Sizes of the dimensions beside x and y, fastest first, by their letters.
struct PlaneOrder {
    std::string letters; // such as "CZT"
    uint64_t z = 1, c = 1, t = 1;

    uint64_t size(char letter) const { return letter == 'Z' ? z : letter == 'C' ? c : t; }
    uint64_t planes() const { return z * c * t; }
};

// The planes of one TiffData, from (z, c, t) on, to the pages from `page` on.
Result<void> assign(const std::string& name, const pugi::xml_node& data, const PlaneOrder& order,
                    uint32_t found_pages, std::vector<std::optional<uint32_t>>& page_of) {
    const bool has_page = data.attribute("IFD") != nullptr;
    const auto page = whole(data, "IFD", 0), first_z = whole(data, "FirstZ", 0),
               first_c = whole(data, "FirstC", 0), first_t = whole(data, "FirstT", 0);
    const auto count = whole(data, "PlaneCount", has_page ? 1 : order.planes());
    if (!page || !first_z || !first_c || !first_t || !count || *first_z >= order.z ||
        *first_c >= order.c || *first_t >= order.t)
        return fail(
            "{}: expected planes within {} slices, {} channels and {} times in its "
            "OME-XML, found others",
            name, order.z, order.c, order.t);
    // The number of the first plane in the order of the file.
    uint64_t plane = 0, stride = 1;
    for (const char letter : order.letters) {
        plane += stride * (letter == 'Z' ? *first_z : letter == 'C' ? *first_c : *first_t);
        stride *= order.size(letter);
    }
    const uint64_t planes = std::min(*count, order.planes() - plane);
    if (*page + planes > found_pages)
        return fail("{}: expected pages 0 .. {} in its OME-XML, found {}", name, found_pages - 1,
                    *page + planes - 1);
    for (uint64_t i = 0; i < planes; ++i) {
        uint64_t rest = plane + i, z = 0, c = 0, t = 0;
        for (const char letter : order.letters) {
            (letter == 'Z' ? z : letter == 'C' ? c : t) = rest % order.size(letter);
            rest /= order.size(letter);
        }
        page_of[z + order.z * (c + order.c * t)] = static_cast<uint32_t>(*page + i);
    }
    return {};
}

// Names of the files that hold planes, where the metadata name any.
std::set<std::string> files_of(const std::vector<pugi::xml_node>& data) {
    std::set<std::string> names;
    for (const pugi::xml_node& each : data)
        for (const pugi::xml_node& uuid : children(each, "UUID"))
            if (const std::string file = uuid.attribute("FileName").value(); !file.empty())
                names.insert(file);
    return names;
}

} // namespace

Result<std::optional<TiffStack>> ome_stack(const std::filesystem::path& path,
                                           const std::string& description, uint32_t found_pages,
                                           std::vector<std::string>& warnings) {
    const std::string name = path.string();
    pugi::xml_document document;
    const pugi::xml_parse_result parsed =
        document.load_buffer(description.data(), description.size());
    const auto roots = children(document, "OME");
    const auto images = roots.empty() ? roots : children(roots[0], "Image");
    const auto all_pixels = images.empty() ? images : children(images[0], "Pixels");
    if (!parsed || all_pixels.empty()) {
        warnings.push_back(fmt::format("{}: its OME-XML is left out: {}", name,
                                       parsed ? "it describes no image" : parsed.description()));
        return std::optional<TiffStack>();
    }
    const pugi::xml_node pixels = all_pixels[0];
    const auto z = whole(pixels, "SizeZ", 1), c = whole(pixels, "SizeC", 1),
               t = whole(pixels, "SizeT", 1);
    const auto channels = children(pixels, "Channel");
    // Colours of one page count as channels; pages hold as many as the first channel says.
    const auto in_page =
        channels.empty() ? std::optional<uint64_t>(1) : whole(channels[0], "SamplesPerPixel", 1);
    const std::string dimensions = pixels.attribute("DimensionOrder").as_string("XYCZT");
    std::string sorted = dimensions.size() == 5 ? dimensions.substr(2) : "";
    std::sort(sorted.begin(), sorted.end());
    if (!z || !c || !t || *z == 0 || *c == 0 || *t == 0 || !in_page || *in_page == 0 ||
        *c % *in_page != 0 || !dimensions.starts_with("XY") || sorted != "CTZ")
        return fail(
            "{}: expected sizes above 0 and an order such as XYZCT in its OME-XML, found {} "
            "x {} x {} and \"{}\"",
            name, z.value_or(0), c.value_or(0), t.value_or(0), dimensions.substr(0, 20));
    PlaneOrder order{dimensions.substr(2), *z, *c / *in_page, *t};
    const auto data = children(pixels, "TiffData");
    if (const std::set<std::string> files = files_of(data);
        files.size() > 1 || (files.size() == 1 && order.z * order.c > found_pages))
        return fail(
            "{}: its OME-XML names {} files with planes, such as {}; expected all planes in "
            "one file",
            name, files.size(), files.begin()->substr(0, 80));
    if (order.z * order.c > found_pages || order.planes() > found_pages)
        return fail(
            "{}: its OME-XML states {} slices, {} channels and {} times, expected at most "
            "the {} pages of the file",
            name, order.z, order.c, order.t, found_pages);
    if (images.size() > 1)
        warnings.push_back(
            fmt::format("{}: holds {} images; the first is read", name, images.size()));
    std::vector<std::optional<uint32_t>> page_of(order.planes());
    if (data.empty())
        PALPATE_TRY(assign(name, pugi::xml_node(), order, found_pages, page_of));
    for (const pugi::xml_node& each : data)
        PALPATE_TRY(assign(name, each, order, found_pages, page_of));

    TiffStack stack;
    stack.slices = static_cast<uint32_t>(order.z);
    stack.channels = static_cast<uint32_t>(order.c);
    stack.times = static_cast<uint32_t>(order.t);
    for (size_t i = 0; i < page_of.size(); ++i) {
        if (!page_of[i])
            return fail(
                "{}: its OME-XML does not say which page is slice {} of channel {} at time "
                "{}",
                name, i % order.z, i / order.z % order.c, i / order.z / order.c);
        stack.pages.push_back(*page_of[i]);
    }
    const auto x_mm = length_mm(name, pixels, 'X', warnings),
               y_mm = length_mm(name, pixels, 'Y', warnings),
               z_mm = length_mm(name, pixels, 'Z', warnings);
    if (!x_mm || !y_mm)
        return std::optional(stack);
    if (stack.slices > 1 && !z_mm)
        warnings.push_back(
            fmt::format("{}: does not state the distance between its slices; that of "
                        "its columns is assumed",
                        name));
    stack.spacing_mm = glm::dvec3(*x_mm, *y_mm, z_mm.value_or(*x_mm));
    return std::optional(stack);
}

} // namespace palpate::io
