// Structure sets that are written, read back, and read by dciodvfy and pydicom.

#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>

#include "engine/io/dicom_structures_write.h"
#include "tests/unit/dicom_write/series.h"

namespace palpate {
namespace {

using test::Folder;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

std::pair<std::string, int> answer_of(const std::string& command) {
    FILE* const pipe = ::popen((command + " 2>&1").c_str(), "r");
    std::string said;
    char buffer[4096];
    for (size_t got; (got = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;)
        said.append(buffer, got);
    return {said, ::pclose(pipe)};
}

class StructureSets : public testing::Test {
 protected:
    void write_reference(const test::SeriesPlace& place) {
        test::fs::remove_all(folder_ / "ct");
        test::write_series(folder_ / "ct", place);
        Result<DicomReference> reference = load_dicom_reference(folder_ / "ct");
        ASSERT_TRUE(reference) << reference.error().message;
        reference_ = std::move(*reference);
    }
    Result<void> save(const Volume& labels, const DicomLabelOptions& options = {}) const {
        return save_dicom_structures(folder_ / "rt.dcm", labels, names_, reference_, options);
    }
    Result<LoadedVolume> read(const char* name = "rt.dcm") const {
        return load_structures(folder_ / name, folder_ / "ct");
    }

    Folder folder_{"structures"};
    DicomReference reference_;
    std::vector<LabelName> names_{{2, "kidney_right", glm::dvec3(1, 0, 0)},
                                  {7, "Größe", glm::dvec3(0, 1, 0.2)}};
};

void expect_same(const Volume& found, const Volume& expected) {
    ASSERT_EQ(found.grid(), expected.grid());
    const glm::uvec3 size = expected.size();
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x)
                ASSERT_EQ(found.value({x, y, z}), expected.value({x, y, z}))
                    << x << " " << y << " " << z;
}

TEST_F(StructureSets, GiveTheSameSamplesBack) {
    std::mt19937 random(23);
    for (int round = 0; round < 10; ++round) {
        write_reference(test::random_place(random));
        const uint16_t last = round % 2 == 0 ? 200 : 60000;
        const Volume labels = test::random_labels(reference_.grid, {2, 7, last}, random);
        if (labels.range().max == 0)
            continue;
        const Result<void> saved = save(labels);
        ASSERT_TRUE(saved) << saved.error().message;
        const auto back = read();
        ASSERT_TRUE(back) << back.error().message;
        expect_same(back->volume, labels);
        EXPECT_EQ(back->modality, "RTSTRUCT");
        for (const LabelName& label : back->labels)
            if (label.label == 7) {
                EXPECT_EQ(label.name, "Größe");
                EXPECT_EQ(label.color, glm::dvec3(0, 1, 0.2)); // 51 of 255
            }
    }
}

// Volumes of organs by two rules that share no code: the samples, and Green's theorem on the file's
// contours (check_structures.py).
TEST_F(StructureSets, AreReadByDciodvfyAndPydicom) {
    std::mt19937 random(31);
    for (int round = 0; round < 4; ++round) {
        test::SeriesPlace place = test::random_place(random);
        place.size = {40, 36, 12};
        place.spacing_mm = {0.7, 1.1, 2.5};
        write_reference(place);
        // Two shells around one middle, of some ml: outlines with holes.
        const glm::dvec3 middle = center_mm(reference_.grid);
        const Volume labels = make_volume(reference_.grid, ScalarType::u8, [&](glm::uvec3 i) {
            const double mm = glm::distance(world_point(reference_.grid, glm::dvec3(i)), middle);
            return mm < 4 ? 0.0 : mm < 8 ? 2.0 : mm < 13 ? 7.0 : 0.0;
        });
        ASSERT_TRUE(save_volume(folder_ / "labels.nii", labels));
        ASSERT_TRUE(save(labels));
        const auto [said, status] = answer_of("dciodvfy " + (folder_ / "rt.dcm").string());
        EXPECT_EQ(status, 0) << said;
        EXPECT_EQ(said.find("Error"), std::string::npos) << said;
        EXPECT_NE(said.find("RTStructureSet"), std::string::npos) << said;
        const auto [compared, failed] =
            answer_of("/usr/bin/python3 " PALPATE_PYDICOM_STRUCTURES " " + folder_.path().string());
        EXPECT_EQ(failed, 0) << compared;
        EXPECT_EQ(compared, "same\n");
        expect_same(read()->volume, labels);
    }
}

// A structure set of others: one structure with contours of points (x, y) in slices.
std::string structure_file(const std::vector<std::pair<std::vector<glm::dvec2>, double>>& contours,
                           const char* kind = "CLOSED_PLANAR", const char* number = "3",
                           const char* frame = test::kFrameOfReference) {
    test::DicomData data, roi, region;
    std::vector<test::DicomData> items;
    for (const auto& [points, z] : contours) {
        std::string text;
        for (const glm::dvec2 at : points)
            text += (text.empty() ? "" : "\\") + test::decimals({at.x, at.y, z});
        test::DicomData item;
        item.put(0x3006, 0x42, "CS", kind).put(0x3006, 0x50, "DS", text);
        items.push_back(item);
    }
    roi.put(0x3006, 0x22, "IS", number).put(0x3006, 0x24, "UI", frame).put(0x3006, 0x26, "LO", "t");
    region.put(0x3006, 0x84, "IS", number).put_items(0x3006, 0x40, items);
    data.put(8, 0x60, "CS", "RTSTRUCT").put_items(0x3006, 0x20, {roi});
    data.put_items(0x3006, 0x39, {region});
    return data.file(test::kStructureClass, "1.2.3.7");
}

class ForeignStructures : public StructureSets {
 protected:
    ForeignStructures() { write_reference({{60, 50, 5}, {1, 1, 3}, glm::dmat3(1.0), {0, 0, 0}}); }
    Result<LoadedVolume> read_file(const std::string& bytes) const {
        test::write(folder_ / "other.dcm", bytes);
        return read("other.dcm");
    }
};

std::vector<glm::dvec2> circle(glm::dvec2 middle, double radius, size_t points = 180) {
    std::vector<glm::dvec2> all;
    for (size_t i = 0; i < points; ++i) {
        const double angle = 2 * M_PI * double(i) / double(points);
        all.push_back(middle + radius * glm::dvec2(std::cos(angle), std::sin(angle)));
    }
    return all;
}
size_t count(const Volume& volume, double label) {
    size_t found = 0;
    for (uint32_t z = 0; z < volume.size().z; ++z)
        for (uint32_t y = 0; y < volume.size().y; ++y)
            for (uint32_t x = 0; x < volume.size().x; ++x)
                found += volume.value({x, y, z}) == label ? 1 : 0;
    return found;
}

TEST_F(ForeignStructures, CirclesKeepTheirAreaAndHolesAreEmpty) {
    const auto loaded = read_file(structure_file({{circle({27.3, 24.6}, 20), 3},
                                                  {circle({27.3, 24.6}, 10), 3},
                                                  {circle({27.3, 24.6}, 4), 3}}));
    ASSERT_TRUE(loaded) << loaded.error().message;
    // The samples on an outline are decided by half of their area: errors of either sign, about
    // 0.3 of a sample each for 2 pi r of them at random: the square root of their number.
    const double area = M_PI * (400 - 100 + 16), outline = 2 * M_PI * (20 + 10 + 4);
    EXPECT_NEAR(double(count(loaded->volume, 3)), area, 3 * 0.3 * std::sqrt(outline));
    EXPECT_EQ(loaded->volume.value({27, 25, 1}), 3);
    EXPECT_EQ(loaded->volume.value({34, 25, 1}), 0);
    EXPECT_EQ(loaded->volume.value({42, 25, 1}), 3);
    EXPECT_EQ(loaded->volume.value({27, 25, 2}), 0);
}

TEST_F(ForeignStructures, ContoursThroughCentresOfSamplesKeepTheirVolume) {
    const auto loaded = read_file(structure_file({{{{10, 10}, {30, 10}, {30, 20}, {10, 20}}, 6}}));
    ASSERT_TRUE(loaded) << loaded.error().message;
    // One of its corners would count, and is covered by a quarter.
    EXPECT_EQ(count(loaded->volume, 3), 20u * 10u - 1u);
}

TEST_F(ForeignStructures, WhatIsNoneIsSaidOrRefused) {
    const auto square = [](double z) {
        return std::pair(std::vector<glm::dvec2>{{1, 1}, {9, 1}, {9, 9}, {1, 9}}, z);
    };
    EXPECT_THAT(read_file(structure_file({square(4.5)})).error().message,
                AllOf(HasSubstr("other.dcm"), HasSubstr("between the slices")));
    EXPECT_THAT(read_file(structure_file({square(3)}, "CLOSED_PLANAR", "3", "9.9")).error().message,
                HasSubstr("another frame of reference (9.9)"));
    EXPECT_THAT(read_file(structure_file({{{{1, 1}, {2, 2}}, 3}})).error().message,
                HasSubstr("three or more points"));
    const auto point = read_file(structure_file({square(3)}, "POINT"));
    ASSERT_TRUE(point);
    EXPECT_THAT(point->warnings, Contains(HasSubstr("'POINT' enclose nothing")));
    const auto beyond = read_file(structure_file({square(3), square(30)}));
    ASSERT_TRUE(beyond);
    EXPECT_THAT(beyond->warnings, Contains(HasSubstr("1 contours lie beyond")));
    EXPECT_EQ(count(beyond->volume, 3), 63u);
    const auto zero = read_file(structure_file({square(3)}, "CLOSED_PLANAR", "0"));
    ASSERT_TRUE(zero);
    EXPECT_EQ(count(zero->volume, 1), 63u);
    EXPECT_THAT(zero->warnings, Contains(HasSubstr("counted from 1")));
    EXPECT_THAT(load_labels(folder_ / "other.dcm").error().message,
                AllOf(HasSubstr("(RTSTRUCT)"), HasSubstr("--reference")));
}

TEST_F(ForeignStructures, PointsOfAnyFinitePlaceAreCutToTheSeries) {
    const auto loaded =
        read_file(structure_file({{{{0.5, -0.5}, {10.5, -0.5}, {5, 1e20}, {6, 2e20}}, 3},
                                  {{{0, 0}, {10, 0}, {5, 9}}, 1e20},
                                  {{{0, 0}, {10, 0}, {5, 9}}, -1e20}}));
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_THAT(loaded->warnings, Contains(HasSubstr("2 contours lie beyond")));
    EXPECT_EQ(count(loaded->volume, 3), 10u * 50u); // columns 1 .. 10, to the last row
}

TEST_F(ForeignStructures, PointsBeyondAllNumbersAreRefused) {
    write_reference({{60, 50, 5}, {0.5, 0.5, 3}, glm::dmat3(1.0), {0, 0, 0}});
    for (const glm::dvec2 far : {glm::dvec2(5, 1.5e308), glm::dvec2(-1.5e308, 5)})
        EXPECT_THAT(
            read_file(structure_file({{{{0, 0}, {10, 0}, far}, 3}})).error().message,
            AllOf(HasSubstr("other.dcm: contour 1 of structure 3 't'"), HasSubstr("too far away")));
}

TEST_F(ForeignStructures, AreKnownByTheirClassAlone) {
    const std::string padded = std::string(test::kStructureClass) + " ";
    const auto square = std::pair(std::vector<glm::dvec2>{{1, 1}, {9, 1}, {9, 9}, {1, 9}}, 3.0);
    for (const bool implicit : {false, true}) {
        test::default_encoding = {implicit, false};
        const std::string whole = structure_file({square});
        test::default_encoding = {};
        // Without a meta header: from the class in the data set on.
        const auto bare = read_file(whole.substr(whole.find(std::string("\x08\0\x16\0", 4))));
        ASSERT_TRUE(bare) << bare.error().message;
        EXPECT_EQ(count(bare->volume, 3), 63u);
        // Padded by a space, as texts are.
        std::string spaced = whole;
        const size_t at = spaced.find(test::kStructureClass);
        ASSERT_EQ(spaced[at + padded.size() - 1], '\0');
        spaced[at + padded.size() - 1] = ' ';
        const auto other = read_file(spaced);
        ASSERT_TRUE(other) << other.error().message;
        EXPECT_EQ(count(other->volume, 3), 63u);
    }
}

TEST_F(ForeignStructures, AnImageThatRefersToAStructureSetIsAnImage) {
    test::DicomData item, image = test::image({{6, 5, 1}, {1, 1, 3}, glm::dmat3(1.0), {}}, 0);
    item.put(8, 0x1150, "UI", test::kStructureClass).put(8, 0x1155, "UI", "1.2.3.7");
    image.put_items(8, 0x1140, {item});
    test::write(folder_ / "image.dcm", image.file(test::kCtClass, "1.2.3.9"));
    const auto loaded = load_volume(folder_ / "image.dcm");
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->volume.size(), glm::uvec3(6, 5, 1));
}

TEST_F(ForeignStructures, AnEmptySetGivesNoLabelsAndNoWarning) {
    test::DicomData data;
    data.put(8, 0x60, "CS", "RTSTRUCT");
    const auto loaded = read_file(data.file(test::kStructureClass, "1.2.3.7"));
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_TRUE(loaded->labels.empty());
    EXPECT_EQ(loaded->volume.range().max, 0.0f);
    EXPECT_THAT(loaded->warnings, ::testing::Not(Contains(HasSubstr("counted from 1"))));
}

// However short a file is cut, there is a sentence or a label map.
TEST_F(ForeignStructures, CutFilesEndInASentence) {
    const std::string whole = structure_file({{circle({20, 20}, 6, 12), 3}});
    for (size_t size = 0; size < whole.size(); size += 37) {
        const auto loaded = read_file(whole.substr(0, size));
        if (!loaded) {
            EXPECT_THAT(loaded.error().message, HasSubstr("other.dcm"));
        }
    }
}

TEST_F(StructureSets, RefusalsLeaveNothing) {
    write_reference({{6, 5, 4}, {1, 1, 3}, glm::dmat3(1.0), {0, 0, 0}});
    const auto of = [](const Grid& at, double value) {
        return make_volume(at, ScalarType::u8, [value](glm::uvec3) { return value; });
    };
    EXPECT_THAT(save(of(reference_.grid, 0)).error().message, HasSubstr("no labels"));
    EXPECT_THAT(save(make_volume(reference_.grid, ScalarType::i16, [](glm::uvec3) { return -1.0; }))
                    .error()
                    .message,
                HasSubstr("expected labels of the type u8 or u16"));
    EXPECT_THAT(save(of(make_grid({6, 5, 4}, {1, 1, 3}, {0.5, 0, 0}), 1)).error().message,
                HasSubstr("another grid"));
    EXPECT_THAT(save(of(make_grid({6, 5, 4}, {1, 1, 3}, {0, 0, 3}), 1)).error().message,
                HasSubstr("lie beyond"));
    DicomLabelOptions elsewhere;
    elsewhere.frame_of_reference = "1.9";
    EXPECT_THAT(save(of(reference_.grid, 1), elsewhere).error().message,
                HasSubstr("another frame of reference"));
    EXPECT_FALSE(test::fs::exists(folder_ / "rt.dcm"));
}

} // namespace
} // namespace palpate
