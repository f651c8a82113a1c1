// Segmentations that are written and read back.

#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "engine/io/dicom_labels_write.h"
#include "engine/io/dicom_modules.h"
#include "tests/unit/dicom_write/series.h"

namespace palpate {
namespace {

using test::Folder;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// Positions, directions and spacings are written with 16 characters, of which a number as small as
// -1.23456789e-05 leaves 8 digits after the point; over 9 samples of 4 mm and 300 mm from the
// origin that is far below this.
constexpr double kNearMm = 1e-5;

void expect_near(const glm::dmat4& a, const glm::dmat4& b) {
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            EXPECT_NEAR(a[column][row], b[column][row], kNearMm) << column << " " << row;
}

std::string bytes_of(const test::fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

class DicomLabelsWritten : public testing::TestWithParam<DicomLabels> {
 protected:
    // A series in "ct", and what it gives.
    void write(const test::SeriesPlace& place) {
        test::fs::remove_all(folder_ / "ct");
        test::write_series(folder_ / "ct", place);
        Result<DicomReference> reference = load_dicom_reference(folder_ / "ct");
        ASSERT_TRUE(reference) << reference.error().message;
        reference_ = std::move(*reference);
    }
    Result<void> save(const Volume& labels, const std::vector<LabelName>& names = {},
                      DicomLabelOptions options = {}) const {
        options.kind = GetParam();
        return save_dicom_labels(folder_ / "seg.dcm", labels, names, reference_, options);
    }
    // A sentence with these words, and no file.
    void expect_refused(const Result<void>& saved, const char* words) const {
        ASSERT_FALSE(saved);
        EXPECT_THAT(saved.error().message, AllOf(HasSubstr("seg.dcm: "), HasSubstr(words)));
        for (const auto& entry : test::fs::directory_iterator(folder_.path()))
            EXPECT_EQ(entry.path().filename(), "ct");
    }

    Folder folder_{"dicom_write"};
    DicomReference reference_;
};
INSTANTIATE_TEST_SUITE_P(Each, DicomLabelsWritten,
                         testing::Values(DicomLabels::binary, DicomLabels::fractional,
                                         DicomLabels::label_map));

TEST_P(DicomLabelsWritten, ComeBackWithGridNamesAndColours) {
    std::mt19937 random(17);
    for (int round = 0; round < 12; ++round) {
        write(test::random_place(random));
        // Numbers with gaps, in one byte or two.
        std::set<uint16_t> chosen;
        std::uniform_int_distribution<int> label(1, round % 2 == 0 ? 255 : 65535);
        for (int i = 0; i < 1 + round % 5; ++i)
            chosen.insert(static_cast<uint16_t>(label(random)));
        const Volume labels =
            test::random_labels(reference_.grid, {chosen.begin(), chosen.end()}, random);
        std::vector<LabelName> names;
        std::uniform_int_distribution<int> byte(0, 255);
        for (const uint16_t one : chosen)
            names.push_back({one, fmt::format("Größe {}", one),
                             glm::dvec3(byte(random), byte(random), byte(random)) / 255.0});
        const Result<void> saved = save(labels, names);
        const bool is_empty = labels.range().max == 0;
        if (is_empty) {
            expect_refused(saved, "no labels");
            continue;
        }
        ASSERT_TRUE(saved) << saved.error().message;
        const auto back = load_labels(folder_ / "seg.dcm");
        test::fs::remove(folder_ / "seg.dcm");
        ASSERT_TRUE(back) << back.error().message;
        EXPECT_EQ(back->frame_of_reference, test::kFrameOfReference);
        ASSERT_EQ(back->volume.size(), labels.size());
        expect_near(back->volume.grid().world_from_index, labels.grid().world_from_index);
        std::set<uint32_t> met;
        for (uint32_t z = 0; z < labels.size().z; ++z)
            for (uint32_t y = 0; y < labels.size().y; ++y)
                for (uint32_t x = 0; x < labels.size().x; ++x) {
                    ASSERT_EQ(back->volume.value({x, y, z}), labels.value({x, y, z}));
                    met.insert(static_cast<uint32_t>(labels.value({x, y, z})));
                }
        met.erase(0);
        ASSERT_EQ(back->labels.size(), met.size());
        for (const LabelName& found : back->labels) {
            EXPECT_TRUE(met.contains(found.label));
            const auto given = std::ranges::find(names, found.label, &LabelName::label);
            EXPECT_EQ(found.name, given->name);
            // L* in steps of 100 / 65535 and a*, b* in steps of 255 / 65535: below half a byte.
            for (int i = 0; i < 3; ++i)
                EXPECT_NEAR((*found.color)[i], (*given->color)[i], 0.5 / 255);
        }
    }
}

TEST_P(DicomLabelsWritten, RefusalsLeaveNothing) {
    std::mt19937 random(5);
    write(test::random_place(random));
    const Grid grid = reference_.grid;
    const auto of = [](const Grid& at, double value) {
        return make_volume(at, ScalarType::u8, [value](glm::uvec3) { return value; });
    };
    expect_refused(save(of(grid, 0)), "no labels");
    expect_refused(save(make_volume(grid, ScalarType::f32, [](glm::uvec3) { return 1.5; })),
                   "expected labels of the type u8 or u16");
    Grid shifted = grid;
    shifted.world_from_index[3] += 0.5 * shifted.world_from_index[0];
    expect_refused(save(of(shifted, 1)), "another grid");
    Grid beyond = grid;
    beyond.world_from_index[3] += beyond.world_from_index[1];
    expect_refused(save(of(beyond, 1)), "lie beyond");
    DicomLabelOptions elsewhere;
    elsewhere.frame_of_reference = "1.2.3.6";
    expect_refused(save(of(grid, 1), {}, elsewhere), "another frame of reference (1.2.3.6)");
    std::stop_source stop;
    stop.request_stop();
    DicomLabelOptions stopped;
    stopped.stop = stop.get_token();
    expect_refused(save(of(grid, 1), {}, stopped), "stopped");
    EXPECT_TRUE(save(of(grid, 1)));
}

void set_attribute(DicomParts& parts, uint32_t tag, const std::string& value) {
    std::erase_if(parts.attributes, [&](const DicomAttribute& one) { return one.tag == tag; });
    parts.attributes.push_back({tag, value});
}

TEST_P(DicomLabelsWritten, ValuesOfAnyLengthOfTheReferenceLeaveAWholeFile) {
    std::mt19937 random(7);
    write(test::random_place(random));
    for (const uint32_t tag : {0x00080050u, 0x00081030u, 0x00100010u, 0x00100020u, 0x00120063u})
        set_attribute(reference_.parts, tag, std::string(70000, 'L'));
    reference_.parts.series_uid = std::string(70000, '1');
    reference_.parts.slices[0].instance_uid = std::string(70000, '2');
    const Volume labels =
        make_volume(reference_.grid, ScalarType::u8, [](glm::uvec3) { return 3.0; });
    ASSERT_TRUE(save(labels));
    const auto back = load_labels(folder_ / "seg.dcm");
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->volume.size(), labels.size());
    EXPECT_EQ(back->volume.range().min, 3.0f);
    EXPECT_LT(test::fs::file_size(folder_ / "seg.dcm"), 65536u);
}

TEST(ObjectsOfReferences, LeaveOutWhatRepresentationsDoNotAllow) {
    const auto keeps = [](uint32_t tag, const std::string& value) {
        DicomParts parts;
        set_attribute(parts, tag, value);
        return io::object_of(parts, {}).encoded().find(value) != std::string::npos;
    };
    const auto letters = [](size_t count) { return std::string(count, 'Q'); };
    EXPECT_TRUE(keeps(0x00080050, letters(16))); // SH
    EXPECT_FALSE(keeps(0x00080050, letters(17)));
    EXPECT_TRUE(keeps(0x00100020, letters(64))); // LO
    EXPECT_FALSE(keeps(0x00100020, letters(65)));
    EXPECT_TRUE(keeps(0x00120063, letters(64) + "\\" + letters(64))); // of several values
    std::string many = letters(64);
    while (many.size() < 70000)
        many += "\\" + letters(64);
    EXPECT_FALSE(keeps(0x00120063, many));
    std::string umlauts; // of two bytes each
    for (int i = 0; i < 64; ++i)
        umlauts += "ö";
    EXPECT_TRUE(keeps(0x00100020, umlauts));
    EXPECT_FALSE(keeps(0x00100020, umlauts + "ö"));
    EXPECT_TRUE(keeps(0x00100010, letters(64) + "=" + letters(64) + "=" + letters(64))); // PN
    EXPECT_FALSE(keeps(0x00100010, letters(5) + "=" + letters(65)));
    EXPECT_FALSE(keeps(0x00100010, "a=b=c=d"));

    const auto keeps_uid = [](const std::string& uid) {
        DicomParts parts;
        parts.study_uid = uid;
        return io::object_of(parts, {}).encoded().find(uid) != std::string::npos;
    };
    EXPECT_TRUE(keeps_uid("9.8." + std::string(60, '7')));
    EXPECT_FALSE(keeps_uid("9.8." + std::string(61, '7')));
    for (const char* const malformed : {"9.8.x7", "9.8..7", ".9.8.7", "9.8.7.", "9.8 7"})
        EXPECT_FALSE(keeps_uid(malformed)) << malformed;
}

TEST(DicomSets, TextLongerThanSixteenBitsTellIsAFault) {
    io::DicomSet set;
    set.text(0x00100020, "LO", std::string(65536, 'L'));
    EXPECT_DEATH((void)set.encoded(), "0xfffe");
    EXPECT_EQ(set.encoded(io::DicomEncoding::implicit_little).size(), 65536u + 8u);
    set.text(0x00100020, "LO", std::string(65534, 'L'));
    EXPECT_EQ(set.encoded().size(), 65534u + 8u);
}

TEST_P(DicomLabelsWritten, TellNothingOfTheMachine) {
    std::mt19937 random(6);
    write(test::random_place(random));
    const Volume labels = test::random_labels(reference_.grid, {3}, random);
    ASSERT_TRUE(save(labels));
    const std::string bytes = bytes_of(folder_ / "seg.dcm");
    char host[256] = {};
    ASSERT_EQ(::gethostname(host, sizeof host - 1), 0);
    EXPECT_EQ(bytes.find(folder_.path().string()), std::string::npos);
    EXPECT_EQ(bytes.find(host), std::string::npos);
    // Another time it is another instance.
    ASSERT_TRUE(save(labels));
    EXPECT_NE(bytes_of(folder_ / "seg.dcm"), bytes);
}

TEST(DicomReferences, AreRefusedWhereNothingCanReferToThem) {
    const Folder folder("references");
    std::mt19937 random(8);
    test::SeriesPlace place = test::random_place(random);
    place.size.z = 3;
    const auto refusal = [&](const std::function<void(test::DicomData&, uint32_t)>& change) {
        test::fs::create_directories(folder / "ct");
        for (uint32_t z = 0; z < place.size.z; ++z) {
            test::DicomData data = test::image(place, z);
            change(data, z);
            test::write(folder / fmt::format("ct/{}.dcm", z),
                        data.file(test::kCtClass, fmt::format("1.2.3.4.{}", z + 1)));
        }
        const auto reference = load_dicom_reference(folder / "ct");
        return reference ? std::string() : reference.error().message;
    };
    EXPECT_EQ(refusal([](test::DicomData&, uint32_t) {}), "");
    const auto without = [](test::DicomData& data, uint32_t z) {
        if (z != 1)
            data.erase(0x20, 0x52);
    };
    EXPECT_THAT(refusal(without), HasSubstr("several frames of reference"));
    EXPECT_THAT(refusal([](test::DicomData& data, uint32_t z) {
                    data.put(0x20, 0x52, "UI", fmt::format("1.2.3.5.{}", z));
                }),
                HasSubstr("several frames of reference"));
    EXPECT_THAT(refusal([](test::DicomData& data, uint32_t) { data.erase(0x20, 0x0d); }),
                HasSubstr("state no study"));
    // UIDs that an object could not repeat would leave it without one.
    for (const auto& [element, what] : {std::pair<uint16_t, const char*>{0x0d, "Study"},
                                        {0x0e, "Series"},
                                        {0x52, "Frame of Reference"}})
        for (const std::string& uid : {std::string("1.2..3"), std::string("1.x"),
                                       std::string(65, '1'), std::string(70, '1')})
            EXPECT_THAT(refusal([&](test::DicomData& data, uint32_t) {
                            data.put(0x20, element, "UI", uid);
                        }),
                        AllOf(HasSubstr("state '" + uid + "' as their "), HasSubstr(what),
                              HasSubstr("expected numbers with dots between them")));
    // A series without a frame of reference gets a new one, which is said.
    EXPECT_EQ(refusal([](test::DicomData& data, uint32_t) { data.erase(0x20, 0x52); }), "");
    const auto lone = load_dicom_reference(folder / "ct");
    ASSERT_TRUE(lone);
    EXPECT_THAT(lone->parts.frame_of_reference_uid, StartsWith("2.25."));
    EXPECT_THAT(lone->warnings, Contains(HasSubstr("states no frame of reference")));
    EXPECT_THAT(load_dicom_reference(folder / "absent").error().message,
                HasSubstr("no such file or folder"));
    test::write(folder / "a.vtk", test::legacy_vtk(true));
    EXPECT_THAT(load_dicom_reference(folder / "a.vtk").error().message,
                HasSubstr("expected a series of DICOM images"));
}

} // namespace
} // namespace palpate
