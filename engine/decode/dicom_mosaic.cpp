#include "engine/decode/dicom_mosaic.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "engine/base/assert.h"
#include "engine/decode/dicom_elements.h"

namespace palpate::io {

namespace {

using gdcm::Tag;
using CsaValues = std::map<std::string, std::vector<std::string>>;

constexpr const char* kImageHeader = "SIEMENS MR HEADER";
constexpr const char* kCsaHeader = "SIEMENS CSA HEADER";
// Siemens scanners make at most a few hundred slices; a damaged number is far off.
constexpr double kMostTiles = 4096;

// Reads little-endian numbers one after another; stops at the end.
struct Cursor {
    std::span<const char> bytes;
    size_t at = 0;

    bool has(size_t count) const { return count <= bytes.size() - at; }
    std::string take(size_t count) {
        std::string part(bytes.data() + at, count);
        at += count;
        return part;
    }
    int32_t number() {
        int32_t value;
        std::memcpy(&value, bytes.data() + at, 4);
        at += 4;
        return value;
    }
};

std::string until_zero(std::string text) {
    text = text.substr(0, text.find('\0'));
    while (!text.empty() && text.back() == ' ')
        text.pop_back();
    const size_t start = text.find_first_not_of(' ');
    return start == std::string::npos ? "" : text.substr(start);
}

std::vector<double> numbers(const CsaValues& values, const std::string& name) {
    std::vector<double> found;
    const auto entry = values.find(name);
    if (entry == values.end())
        return found;
    for (const std::string& text : entry->second) {
        char* stop = nullptr;
        const double value = std::strtod(text.c_str(), &stop);
        if (stop == text.c_str() || !std::isfinite(value))
            return {};
        found.push_back(value);
    }
    return found;
}

CsaValues csa_of(const gdcm::DataSet& set) {
    const auto tag = private_tag(set, 0x0029, kCsaHeader, 0x10);
    const gdcm::DataElement* found = tag ? element(set, *tag) : nullptr;
    const gdcm::ByteValue* bytes = found ? found->GetByteValue() : nullptr;
    return bytes ? csa_values({bytes->GetPointer(), bytes->GetLength()}) : CsaValues{};
}

double tile_count(const gdcm::DataSet& set, const CsaValues& csa) {
    if (const auto tag = private_tag(set, 0x0019, kImageHeader, 0x0a))
        if (const auto count = io::numbers<uint16_t>(set, *tag); !count.empty())
            return count.front();
    const std::vector<double> count = numbers(csa, "NumberOfImagesInMosaic");
    return count.empty() ? 0.0 : count.front();
}

} // namespace

CsaValues csa_values(std::span<const char> bytes) {
    CsaValues values;
    Cursor in{bytes};
    const bool second = bytes.size() >= 8 && std::memcmp(bytes.data(), "SV10", 4) == 0;
    if (second)
        in.at = 8;
    if (!in.has(8))
        return values;
    const int32_t count = in.number();
    in.at += 4;
    // In the first format the lengths of values are raised by the first entry's number of items.
    int32_t raised = 0;
    for (int32_t tag = 0; tag < std::min(count, 1024); ++tag) {
        if (!in.has(84))
            return values;
        const std::string name = until_zero(in.take(64));
        const int32_t multiplicity = in.number();
        in.at += 8; // the value representation, and its number
        const int32_t items = in.number();
        in.at += 4;
        if (tag == 0)
            raised = items;
        std::vector<std::string> found;
        for (int32_t i = 0; i < items; ++i) {
            if (!in.has(16))
                return values;
            const int32_t first = in.number(), next = in.number();
            in.at += 8;
            const int64_t length = second ? next : int64_t{first} - raised;
            if (length < 0 || !in.has(static_cast<size_t>(length))) {
                if (second || i < multiplicity)
                    return values;
                break; // the first format ends lists of absent values early
            }
            const std::string text = until_zero(in.take(static_cast<size_t>(length)));
            in.at = std::min(in.bytes.size(), (in.at + 3) / 4 * 4);
            if (i < multiplicity || (multiplicity == 0 && !text.empty()))
                found.push_back(text);
        }
        values[name] = std::move(found);
    }
    return values;
}

bool is_mosaic(const gdcm::DataSet& set) {
    const std::vector<std::string> kinds = texts(set, Tag(0x0008, 0x0008));
    return std::find(kinds.begin(), kinds.end(), "MOSAIC") != kinds.end();
}

Result<std::vector<DicomFrame>> mosaic_frames(const std::string& name, const gdcm::DataSet& set,
                                              const DicomFrame& plane) {
    const auto refuse = [&](const std::string& lacks) {
        return fail("{}: is a Siemens mosaic whose header lacks {}", name, lacks);
    };
    const CsaValues csa = csa_of(set);
    const double tiles = tile_count(set, csa);
    if (!(tiles >= 1 && tiles <= kMostTiles))
        return refuse("the number of its slices (NumberOfImagesInMosaic)");
    const auto count = static_cast<uint32_t>(tiles);
    const auto side = static_cast<uint32_t>(std::ceil(std::sqrt(tiles)));
    if (plane.size.x % side != 0 || plane.size.y % side != 0)
        return fail(
            "{}: is a Siemens mosaic of {} slices, but {} x {} samples are not {} x {} tiles", name,
            count, plane.size.x, plane.size.y, side, side);
    if (!plane.position || !plane.axes || !plane.spacing_mm)
        return refuse("its position, orientation or pixel spacing");
    const std::vector<double> normal = numbers(csa, "SliceNormalVector");
    if (normal.size() != 3)
        return refuse("the direction in which its slices are stacked (SliceNormalVector)");
    const glm::dvec3 cross = glm::cross((*plane.axes)[0], (*plane.axes)[1]);
    const double along = glm::dot(cross, glm::dvec3(normal[0], normal[1], normal[2]));
    if (!(std::abs(std::abs(along) - 1) < 1e-2))
        return fail("{}: is a Siemens mosaic whose slices are not stacked along their normal",
                    name);
    std::optional<double> step = decimal(set, Tag(0x0018, 0x0088));
    if (const auto stated = numbers(csa, "SpacingBetweenSlices"); !step && !stated.empty())
        step = stated.front();
    if (!step || !(*step > 0)) {
        if (count > 1)
            return refuse("the spacing of its slices (SpacingBetweenSlices)");
        step = plane.slice_step_mm.value_or(1.0);
    }
    // The stated position is that of an image as large as the mosaic, centred where each tile is.
    DicomFrame first = plane;
    first.size = plane.size / side;
    const glm::dvec2 excess_mm = 0.5 * glm::dvec2(plane.size - first.size) * *plane.spacing_mm;
    *first.position += *plane.axes * excess_mm;
    first.slice_step_mm = step;
    std::vector<DicomFrame> frames;
    for (uint32_t i = 0; i < count; ++i) {
        DicomFrame& frame = frames.emplace_back(first);
        frame.frame = i;
        *frame.position += cross * (along < 0 ? -*step : *step) * static_cast<double>(i);
    }
    return frames;
}

std::vector<char> untile(std::span<const char> pixels, glm::uvec2 plane, glm::uvec2 tile,
                         size_t count, size_t bytes_per_sample) {
    PALPATE_ASSERT_CMP(pixels.size(), ==, size_t{plane.x} * plane.y * bytes_per_sample);
    const size_t row_bytes = tile.x * bytes_per_sample;
    std::vector<char> tiles(count * tile.y * row_bytes);
    char* to = tiles.data();
    const uint32_t side = plane.x / tile.x;
    for (size_t i = 0; i < count; ++i)
        for (uint32_t y = 0; y < tile.y; ++y, to += row_bytes) {
            const size_t row = i / side * tile.y + y;
            std::memcpy(to, &pixels[(row * plane.x + i % side * tile.x) * bytes_per_sample],
                        row_bytes);
        }
    return tiles;
}

} // namespace palpate::io
