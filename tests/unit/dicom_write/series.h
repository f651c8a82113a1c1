#pragma once

#include <fmt/format.h>

#include <glm/glm.hpp>
#include <random>
#include <string>

#include "engine/volume/builder.h"
#include "tests/unit/io/dicom_bytes.h"

// Series of images at any place, and label maps that lie on them.
namespace palpate::test {

constexpr const char* kFrameOfReference = "1.2.3.5";

struct SeriesPlace {
    glm::uvec3 size{};
    glm::dvec3 spacing_mm{};
    glm::dmat3 axes{1.0}; // along rows, columns and slices
    glm::dvec3 origin_mm{};
};

// As many digits as a decimal string has room for.
inline std::string decimals(std::initializer_list<double> values) {
    std::string all;
    for (const double value : values)
        all += fmt::format("{}{:.9g}", all.empty() ? "" : "\\", value);
    return all;
}

// The rotation by a random quaternion.
inline glm::dmat3 random_rotation(std::mt19937& random) {
    std::normal_distribution<double> normal;
    const auto direction = [&] {
        return glm::dvec3(normal(random), normal(random), normal(random));
    };
    const glm::dvec3 x = glm::normalize(direction());
    const glm::dvec3 y = glm::normalize(glm::cross(direction(), x));
    return {x, y, glm::cross(x, y)};
}

inline SeriesPlace random_place(std::mt19937& random) {
    std::uniform_real_distribution<double> mm(0.3, 4.0), far(-300.0, 300.0);
    std::uniform_int_distribution<uint32_t> side(2, 9), slices(1, 6);
    SeriesPlace place;
    place.size = {side(random), side(random), slices(random)};
    place.spacing_mm = {mm(random), mm(random), mm(random)};
    place.axes = random_rotation(random);
    place.origin_mm = {far(random), far(random), far(random)};
    return place;
}

// One image of a series. The patient's name is "Müller^Jörg" in Latin 1.
inline DicomData image(const SeriesPlace& place, uint32_t z) {
    DicomData data = samples(static_cast<uint16_t>(place.size.x),
                             static_cast<uint16_t>(place.size.y), 16, 16, true);
    data.put(8, 5, "CS", "ISO_IR 100").put(8, 0x20, "DA", "20040119");
    data.put(8, 0x50, "SH", "A1").put(8, 0x60, "CS", "CT").put(8, 0x103e, "LO", "abdomen");
    data.put(0x10, 0x10, "PN", "M\xfcller^J\xf6rg").put(0x10, 0x20, "LO", "P-17");
    data.put(0x10, 0x30, "DA", "19700102").put(0x10, 0x40, "CS", "M");
    data.put(0x20, 0x0d, "UI", "1.2.3").put(0x20, 0x0e, "UI", "1.2.3.4");
    data.put(0x20, 0x10, "SH", "S1").put(0x20, 0x13, "IS", std::to_string(z + 1));
    data.put(0x20, 0x52, "UI", kFrameOfReference);
    const glm::dvec3 at = place.origin_mm + place.axes[2] * (place.spacing_mm.z * z);
    const glm::dvec3 row = place.axes[0], column = place.axes[1];
    data.put(0x20, 0x32, "DS", decimals({at.x, at.y, at.z}));
    data.put(0x20, 0x37, "DS", decimals({row.x, row.y, row.z, column.x, column.y, column.z}));
    data.put(0x28, 0x30, "DS", decimals({place.spacing_mm.y, place.spacing_mm.x}));
    data.put(0x18, 0x50, "DS", decimals({place.spacing_mm.z}));
    data.put(0x18, 0x88, "DS", decimals({place.spacing_mm.z}));
    data.put(0x7fe0, 0x10, "OW",
             words_16(std::vector<int>(size_t{place.size.x} * place.size.y, int(z))));
    return data;
}

inline void write_series(const fs::path& folder, const SeriesPlace& place) {
    fs::create_directories(folder);
    for (uint32_t z = 0; z < place.size.z; ++z)
        write(folder / fmt::format("{}.dcm", z),
              image(place, z).file(kCtClass, fmt::format("1.2.3.4.{}", z + 1)));
}

// Labels at random, a third of the samples without one.
inline Volume random_labels(const Grid& grid, std::vector<uint16_t> labels, std::mt19937& random) {
    labels.insert(labels.begin(), 1 + labels.size() / 2, 0);
    std::uniform_int_distribution<size_t> choose(0, labels.size() - 1);
    const uint16_t most = *std::max_element(labels.begin(), labels.end());
    return make_volume(grid, most > 255 ? ScalarType::u16 : ScalarType::u8,
                       [&](glm::uvec3) { return double(labels[choose(random)]); });
}

} // namespace palpate::test
