// Where the frames of DICOM files lie, and how they follow one another: files made at random from a
// known answer, in every encoding.

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <random>

#include "engine/base/error.h"
#include "engine/decode/dicom_elements.h"
#include "tests/unit/io/dicom_bytes.h"
#include "tests/unit/io_formats/decode_here.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using test::DicomData;
using test::Folder;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

using Random = std::mt19937;

constexpr const char* kNuclearClass = "1.2.840.10008.5.1.4.1.1.20";
constexpr const char* kEnhancedMrClass = "1.2.840.10008.5.1.4.1.1.4.1";
constexpr const char* kVolumeClass = "1.2.840.10008.5.1.4.1.1.6.2";

// Numbers as decimal strings, which hold 16 characters each.
std::string decimal_string(const std::vector<double>& values) {
    std::string text;
    for (const double value : values)
        text += (text.empty() ? "" : "\\") + fmt::format("{:.9g}", value);
    return text;
}

// A volume in time: `times` frames of `slices` slices, with slice k at origin + k * step * normal.
struct Truth {
    uint16_t columns = 5, rows = 3, slices = 4, times = 1;
    glm::dvec3 origin{}, across{1, 0, 0}, down{0, 1, 0};
    glm::dvec2 spacing{1};
    double step = 1; // negative: against the normal

    static int value(int x, int y, int slice, int time) {
        return x + 10 * y + 100 * slice + 2000 * time;
    }
    std::vector<double> place(int slice) const {
        const glm::dvec3 at = origin + slice * step * glm::cross(across, down);
        return {at.x, at.y, at.z};
    }
    std::vector<double> axes() const {
        return {across.x, across.y, across.z, down.x, down.y, down.z};
    }
};

double between(Random& random, double low, double high) {
    return low + (high - low) * static_cast<double>(random() % 10001) / 10000;
}

Truth random_truth(Random& random, bool in_time) {
    Truth truth;
    truth.columns = static_cast<uint16_t>(3 + random() % 4);
    truth.rows = static_cast<uint16_t>(2 + random() % 4);
    truth.slices = static_cast<uint16_t>(2 + random() % 6);
    truth.times = static_cast<uint16_t>(in_time ? 2 + random() % 4 : 1);
    for (int i = 0; i < 3; ++i)
        truth.origin[i] = between(random, -200, 200);
    const glm::dvec3 a(between(random, -1, 1), between(random, -1, 1), 1.5);
    truth.across = glm::normalize(a);
    truth.down =
        glm::normalize(glm::cross(truth.across, glm::dvec3(between(random, 0.5, 1), 0, 0)));
    truth.spacing = {between(random, 0.3, 4), between(random, 0.3, 4)};
    truth.step = between(random, 0.3, 6) * (random() % 2 == 0 ? 1 : -1);
    return truth;
}

// The frames of a file in some order: each a slice and a time, both from 0.
struct Stored {
    int slice = 0, time = 0;
};

std::vector<Stored> stored_frames(Random& random, const Truth& truth, bool shuffled) {
    std::vector<Stored> frames;
    for (int time = 0; time < truth.times; ++time)
        for (int slice = 0; slice < truth.slices; ++slice)
            frames.push_back({slice, time});
    for (size_t i = frames.size() - 1; shuffled && i > 0; --i)
        std::swap(frames[i], frames[random() % (i + 1)]);
    return frames;
}

// An image of several frames without a word about where they lie.
DicomData image_of(const Truth& truth, const std::vector<Stored>& frames) {
    DicomData data = test::samples(truth.columns, truth.rows, 16, 16, false);
    data.put(0x20, 0x0e, "UI", "1.2").put(0x20, 0x13, "IS", "1");
    if (frames.size() > 1)
        data.put(0x28, 8, "IS", std::to_string(frames.size()));
    std::vector<int> values;
    for (const Stored& frame : frames)
        for (int y = 0; y < truth.rows; ++y)
            for (int x = 0; x < truth.columns; ++x)
                values.push_back(Truth::value(x, y, frame.slice, frame.time));
    return data.put(0x7fe0, 0x10, "OW", test::words_16(values));
}

void put_spacing(const Truth& truth, DicomData& data) {
    data.put(0x28, 0x30, "DS", decimal_string({truth.spacing.y, truth.spacing.x}));
}

Result<io::DecodedHere> decoded(const fs::path& path, std::optional<uint32_t> frame = {}) {
    return io::decode_here(path, frame);
}

// Every sample must lie where the truth has it.
void expect_truth(const fs::path& path, const Truth& truth) {
    for (uint32_t time = 0; time < truth.times; ++time) {
        const auto found = decoded(path, truth.times > 1 ? std::optional(time) : std::nullopt);
        ASSERT_TRUE(found) << found.error().message;
        const Grid& grid = found->decoded.grid;
        ASSERT_EQ(grid.size, glm::uvec3(truth.columns, truth.rows, truth.slices));
        const glm::dmat4 index_from_world = glm::inverse(grid.world_from_index);
        for (int slice = 0; slice < truth.slices; ++slice)
            for (int y = 0; y < truth.rows; ++y)
                for (int x = 0; x < truth.columns; ++x) {
                    const glm::dvec3 world =
                        truth.origin + truth.across * (x * truth.spacing.x) +
                        truth.down * (y * truth.spacing.y) +
                        glm::cross(truth.across, truth.down) * (slice * truth.step);
                    const glm::dvec3 at(index_from_world * glm::dvec4(world, 1));
                    const glm::dvec3 nearest = glm::round(at);
                    // Nine digits of 200 mm and of unit vectors, at spacings from 0.3 mm.
                    ASSERT_LT(glm::distance(at, nearest), 1e-5);
                    const auto i = glm::uvec3(nearest);
                    ASSERT_LT(i.z, grid.size.z);
                    EXPECT_EQ(found->values[(i.z * grid.size.y + i.y) * grid.size.x + i.x],
                              Truth::value(x, y, slice, static_cast<int>(time)));
                }
    }
}

// No reference can be taken out of an item that is about to go.
template <class Item>
concept GivesItsData = requires(Item&& item) {
    *std::forward<Item>(item);
};
static_assert(GivesItsData<io::DicomItem&> && GivesItsData<const io::DicomItem&>);
static_assert(!GivesItsData<io::DicomItem> && !GivesItsData<const io::DicomItem>);

class DicomFrames : public test::InEveryEncoding {
 protected:
    void write(const DicomData& data, const char* class_uid, const std::string& name = "a.dcm") {
        test::write(folder_ / name, data.file(class_uid, "1.2.3." + name));
    }
    std::string error_of(const DicomData& data, const char* class_uid = kNuclearClass) {
        write(data, class_uid);
        const auto found = decoded(folder_ / "a.dcm");
        return found ? "read" : found.error().message;
    }
    Folder folder_{"frames"};
};
INSTANTIATE_TEST_SUITE_P(Each, DicomFrames, test::every_encoding(), test::encoding_name);

// ---- nuclear medicine

// Vectors count from 1 for each frame.
DicomData nuclear(const Truth& truth, const std::vector<Stored>& frames) {
    DicomData data = image_of(truth, frames), detector;
    data.put(8, 8, "CS", "ORIGINAL\\PRIMARY\\RECON TOMO\\EMISSION").put(8, 0x60, "CS", "NM");
    data.put(0x18, 0x88, "DS", decimal_string({truth.step}));
    put_spacing(truth, data);
    detector.put(0x20, 0x32, "DS", decimal_string(truth.place(0)));
    detector.put(0x20, 0x37, "DS", decimal_string(truth.axes()));
    data.put_items(0x54, 0x22, {detector});
    std::vector<uint16_t> slices, times, ones(frames.size(), 1);
    for (const Stored& frame : frames) {
        slices.push_back(static_cast<uint16_t>(frame.slice + 1));
        times.push_back(static_cast<uint16_t>(frame.time + 1));
    }
    data.put_words(0x54, 0x80, slices).put_words(0x54, 0x81, {truth.slices});
    if (truth.times == 1)
        return data.put_words(0x28, 9, {0x54, 0x80}, "AT");
    data.put_words(0x54, 0x60, ones).put_words(0x54, 0x70, times);
    return data.put_words(0x28, 9, {0x54, 0x60, 0x54, 0x70, 0x54, 0x80}, "AT");
}

TEST_P(DicomFrames, OfNuclearMedicineFollowTheSliceVectorAndTheSignOfTheSpacing) {
    for (uint32_t seed = 0; seed < 12; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const Truth truth = random_truth(random, seed % 3 == 2);
        write(nuclear(truth, stored_frames(random, truth, seed % 2 == 1)), kNuclearClass);
        expect_truth(folder_ / "a.dcm", truth);
        // The first slice is the first of the volume, whichever way the others follow.
        const auto found = decoded(folder_ / "a.dcm");
        ASSERT_TRUE(found) << found.error().message;
        EXPECT_LT(glm::distance(glm::dvec3(found->decoded.grid.world_from_index[3]), truth.origin),
                  1e-5);
        if (truth.times > 1)
            EXPECT_THAT(found->decoded.notes, Contains(HasSubstr("ordered by TimeSlotVector")));
        else
            EXPECT_THAT(found->decoded.warnings, IsEmpty());
    }
}

TEST_P(DicomFrames, OfNuclearMedicineAreSlicesAlsoWithoutAPosition) {
    Random random(3);
    Truth truth = random_truth(random, true);
    truth.origin = {};
    truth.across = {1, 0, 0};
    truth.down = {0, 1, 0};
    DicomData data = nuclear(truth, stored_frames(random, truth, true)), detector;
    write(data.erase(0x54, 0x22), kNuclearClass);
    expect_truth(folder_ / "a.dcm", truth);
    detector.put(0x54, 0x200, "DS", "0"); // the start angle of a detector that states no more
    write(data.put_items(0x54, 0x22, {detector}), kNuclearClass);
    expect_truth(folder_ / "a.dcm", truth);
    EXPECT_THAT(decoded(folder_ / "a.dcm")->decoded.warnings,
                AllOf(Contains(HasSubstr("(0, 0, 0) mm is assumed")),
                      Contains(HasSubstr("orientation (axial)"))));
}

TEST_P(DicomFrames, OfNuclearMedicineAreRefusedByTheVectorThatDoesNotFit) {
    Random random(1);
    const Truth truth = random_truth(random, false);
    const DicomData data = nuclear(truth, stored_frames(random, truth, false));
    EXPECT_THAT(error_of(DicomData(data).put_words(0x54, 0x80, {1, 2, 3, 4, 5, 6, 7, 8, 9})),
                AllOf(HasSubstr("SliceVector has 9 numbers"), HasSubstr("frames")));
    std::vector<uint16_t> slices(truth.slices);
    EXPECT_THAT(error_of(DicomData(data).put_words(0x54, 0x80, slices)), HasSubstr("holds 0"));
    // Slices in order need no vector, those of several times do.
    EXPECT_EQ(error_of(DicomData(data).erase(0x54, 0x80)), "read");
    expect_truth(folder_ / "a.dcm", truth);
    const Truth gated = random_truth(random, true);
    EXPECT_THAT(error_of(nuclear(gated, stored_frames(random, gated, false)).erase(0x54, 0x80)),
                HasSubstr("SliceVector has 0 numbers"));
    // Every frame in one place, and no vector that tells them apart.
    std::fill(slices.begin(), slices.end(), 1);
    EXPECT_EQ(error_of(DicomData(data).put_words(0x54, 0x80, slices)), "read");
    const auto cine = decoded(folder_ / "a.dcm");
    EXPECT_EQ(cine->decoded.grid.size.z, 1u);
    EXPECT_THAT(cine->decoded.notes, Contains(HasSubstr("order in the file")));
}

TEST_P(DicomFrames, OfNuclearProjectionsAreNoSlices) {
    Random random(1);
    Truth truth = random_truth(random, false);
    const std::vector<Stored> frames = stored_frames(random, truth, false);
    DicomData data = nuclear(truth, frames);
    std::vector<uint16_t> views(frames.size());
    for (size_t i = 0; i < views.size(); ++i)
        views[i] = static_cast<uint16_t>(views.size() - i);
    data.erase(0x54, 0x80).put_words(0x54, 0x90, views).put_words(0x28, 9, {0x54, 0x90}, "AT");
    write(data, kNuclearClass);
    const auto last = decoded(folder_ / "a.dcm", 0);
    ASSERT_TRUE(last) << last.error().message;
    EXPECT_EQ(last->decoded.grid.size.z, 1u);
    EXPECT_EQ(last->values[0], Truth::value(0, 0, truth.slices - 1, 0)); // view 1 is stored last
}

// ---- one position for the whole file

DicomData classic(const Truth& truth, const std::vector<Stored>& frames) {
    DicomData data = image_of(truth, frames);
    data.put(8, 0x60, "CS", "CT").put(0x18, 0x88, "DS", decimal_string({truth.step}));
    data.put(0x20, 0x32, "DS", decimal_string(truth.place(0)));
    data.put(0x20, 0x37, "DS", decimal_string(truth.axes()));
    put_spacing(truth, data);
    return data;
}

TEST_P(DicomFrames, OfOnePositionAreSlicesAtTheStatedSpacing) {
    for (uint32_t seed = 0; seed < 6; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        Truth truth = random_truth(random, false);
        const auto frames = stored_frames(random, truth, false);
        DicomData data = classic(truth, frames);
        if (seed % 2 == 1)
            data.put_words(0x28, 9, {0x18, 0x2005}, "AT");
        write(data, test::kCtClass);
        expect_truth(folder_ / "a.dcm", truth);
        // Thickness stands in for a spacing, with a word.
        truth.step = std::abs(truth.step);
        write(classic(truth, frames)
                  .erase(0x18, 0x88)
                  .put(0x18, 0x50, "DS", decimal_string({truth.step})),
              test::kCtClass);
        expect_truth(folder_ / "a.dcm", truth);
        EXPECT_THAT(decoded(folder_ / "a.dcm")->decoded.warnings, Contains(HasSubstr("thickness")));
    }
}

TEST_P(DicomFrames, InTimeLieAtOnePosition) {
    Random random(1);
    Truth truth = random_truth(random, true);
    truth.slices = 1;
    DicomData data = classic(truth, stored_frames(random, truth, false));
    data.put_words(0x28, 9, {0x18, 0x1063}, "AT").put(0x18, 0x1063, "DS", "40");
    write(data, test::kMrClass);
    expect_truth(folder_ / "a.dcm", truth);
}

// ---- functional groups

enum class Tells { nothing, temporal_position, echo_time, trigger_time, b_value, index };

// `volume`: as ultrasound volumes state places, else as other enhanced images do.
DicomData enhanced(const Truth& truth, const std::vector<Stored>& frames, bool volume,
                   Tells tells) {
    DicomData data = image_of(truth, frames), axes, measures, shared;
    if (volume)
        axes.put_doubles(0x20, 0x9302, truth.axes());
    else
        axes.put(0x20, 0x37, "DS", decimal_string(truth.axes()));
    put_spacing(truth, measures);
    measures.put(0x18, 0x50, "DS", "1");
    shared.put_items(0x20, volume ? 0x930f : 0x9116, {axes}).put_items(0x28, 0x9110, {measures});
    std::vector<DicomData> per_frame;
    for (const Stored& frame : frames) {
        DicomData position, content, group, item;
        if (volume)
            position.put_doubles(0x20, 0x9301, truth.place(frame.slice));
        else
            position.put(0x20, 0x32, "DS", decimal_string(truth.place(frame.slice)));
        group.put_items(0x20, volume ? 0x930e : 0x9113, {position});
        const auto slice = static_cast<uint32_t>(frame.slice + 1);
        const auto time = static_cast<uint32_t>(frame.time + 1);
        if (tells == Tells::temporal_position)
            content.put_longs(0x20, 0x9128, {time});
        if (tells == Tells::index)
            content.put_longs(0x20, 0x9157, {1, slice, time});
        group.put_items(0x20, 0x9111, {content});
        if (tells == Tells::echo_time)
            group.put_items(0x18, 0x9114, {item.put_doubles(0x18, 0x9082, {1.5 * time})});
        if (tells == Tells::trigger_time)
            group.put_items(0x18, 0x9118, {item.put_doubles(0x20, 0x9153, {31.0 * time})});
        if (tells == Tells::b_value)
            group.put_items(0x18, 0x9117, {item.put_doubles(0x18, 0x9087, {500.0 * time})});
        per_frame.push_back(group);
    }
    return data.put(8, 0x60, "CS", volume ? "US" : "MR")
        .put_items(0x5200, 0x9229, {shared})
        .put_items(0x5200, 0x9230, per_frame);
}

TEST_P(DicomFrames, OfEnhancedImagesLieWhereTheirGroupsPlaceThem) {
    for (uint32_t seed = 0; seed < 12; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const bool volume = (seed + seed / 6) % 2 == 1;
        const auto tells = static_cast<Tells>(seed % 6);
        const Truth truth = random_truth(random, tells != Tells::nothing);
        write(enhanced(truth, stored_frames(random, truth, true), volume, tells),
              volume ? kVolumeClass : kEnhancedMrClass);
        expect_truth(folder_ / "a.dcm", truth);
        const auto found = decoded(folder_ / "a.dcm", truth.times - 1);
        if (volume)
            EXPECT_THAT(found->decoded.warnings, Contains(HasSubstr("axes of its transducer")));
        else
            EXPECT_THAT(found->decoded.warnings, IsEmpty());
    }
}

// As archives write explicit files again whose sequences they did not know.
TEST_P(DicomFrames, OfEnhancedImagesLieThereInSequencesOfUnknownRepresentation) {
    Random random(7);
    const Truth truth = random_truth(random, true);
    const DicomData data =
        enhanced(truth, stored_frames(random, truth, true), false, Tells::echo_time);
    test::write(folder_ / "a.dcm", data.file(kEnhancedMrClass, "1.2.3", test::kExplicitLittle,
                                             {false, GetParam().delimited, true}));
    expect_truth(folder_ / "a.dcm", truth);
}

TEST_P(DicomFrames, OfEnhancedImagesAreRefusedWhereNothingTellsThemApart) {
    Random random(1);
    const Truth truth = random_truth(random, true);
    EXPECT_THAT(error_of(enhanced(truth, stored_frames(random, truth, true), false, Tells::nothing),
                         kEnhancedMrClass),
                AllOf(HasSubstr("a.dcm: "), HasSubstr("no attribute tells")));
}

// ---- a file for each image

using Say = std::function<void(DicomData&, int slice, int time)>;

void put_private(DicomData& data, uint16_t group, const char* creator, uint8_t number,
                 const char* vr, const std::string& value) {
    data.put(group, 0x10, "LO", creator);
    data.put(group, static_cast<uint16_t>(0x1000 | number), vr, value);
}

TEST_P(DicomFrames, OfOneFileEachFollowWhatTellsThemApart) {
    const std::pair<const char*, Say> cases[] = {
        {"TemporalPositionIdentifier (1, 2",
         [](DicomData& data, int, int t) { data.put(0x20, 0x100, "IS", std::to_string(t + 1)); }},
        {"TriggerTime (0, 31.5",
         [](DicomData& data, int, int t) {
             data.put(0x18, 0x1060, "DS", decimal_string({t * 31.5}));
         }},
        {"EchoTime (2.3, 4.6",
         [](DicomData& data, int, int t) {
             data.put(0x18, 0x81, "DS", decimal_string({2.3 * (t + 1)}));
         }},
        {"AcquisitionNumber (9, 10",
         [](DicomData& data, int, int t) { data.put(0x20, 0x12, "IS", std::to_string(t + 9)); }},
        {"AcquisitionTime (09:59:58.500, 09:59:59.500",
         [](DicomData& data, int, int t) {
             data.put(
                 8, 0x32, "TM",
                 t < 2 ? fmt::format("0959{}.5", 58 + t) : fmt::format("1000{:02}.500000", t - 2));
         }},
        {"AcquisitionTime (23:59:59.000, 00:00:00.250", // over midnight
         [](DicomData& data, int, int t) {
             data.put(8, 0x2a, "DT",
                      t == 0 ? "20231231235959" : fmt::format("2024010100000{}.25+0000", t - 1));
         }},
        {"AcquisitionTime",
         [](DicomData& data, int z, int t) {
             data.put(8, 0x22, "DA", fmt::format("202403{}", 10 + t));
             data.put(8, 0x32, "TM", fmt::format("{:02}:0{}:00", 23 - t, z));
         }},
        {"DiffusionBValue (0, 250",
         [](DicomData& data, int, int t) { data.put_doubles(0x18, 0x9087, {t * 250.0}); }},
        {"DiffusionBValue (0, 250",
         [](DicomData& data, int, int t) {
             put_private(data, 0x19, "SIEMENS MR HEADER", 0x0c, "IS", std::to_string(t * 250));
         }},
        {"DiffusionBValue (0, 250",
         [](DicomData& data, int, int t) {
             put_private(data, 0x43, "GEMS_PARM_01", 0x39, "IS",
                         fmt::format("{}\\8\\0\\0", 1000000000 + t * 250));
         }},
        {"DiffusionBValue (0, 250",
         [](DicomData& data, int, int t) {
             put_private(data, 0x2001, "Philips Imaging DD 001", 0x03, "FL",
                         test::little(std::bit_cast<uint32_t>(250.0f * static_cast<float>(t)), 4));
         }},
        {"DiffusionBValue, then DiffusionGradientOrientation x, then",
         [](DicomData& data, int, int t) {
             data.put_doubles(0x18, 0x9087, {t == 0 ? 0.0 : 1000.0});
             if (t > 0)
                 data.put_doubles(0x18, 0x9089, {t == 3 ? 1.0 : 0.0, t == 2 ? 1.0 : 0.0, 0.0});
         }},
        {"ImageType",
         [](DicomData& data, int, int t) {
             data.put(8, 8, "CS", fmt::format("ORIGINAL\\PRIMARY\\{}", "IMPR"[t]));
         }},
        {"TriggerTime, then EchoTime",
         [](DicomData& data, int, int t) {
             data.put(0x18, 0x1060, "DS", t < 2 ? "0" : "40")
                 .put(0x18, 0x81, "DS", t % 2 ? "9" : "3");
         }},
    };
    uint32_t seed = 0;
    for (const auto& [words, say] : cases) {
        SCOPED_TRACE(words);
        Random random(++seed);
        Truth truth = random_truth(random, true);
        truth.times = std::min<uint16_t>(truth.times, 4);
        if (std::string(words).find("then") != std::string::npos)
            truth.times = 4;
        truth.slices = 3;
        truth.step = std::abs(truth.step);
        const Folder folder("files");
        const auto images = stored_frames(random, truth, true);
        for (size_t i = 0; i < images.size(); ++i) {
            DicomData data = image_of(truth, {images[i]});
            data.put(8, 0x60, "CS", "MR").put(0x20, 0x13, "IS", std::to_string(random() % 5));
            data.put(0x20, 0x32, "DS", decimal_string(truth.place(images[i].slice)));
            data.put(0x20, 0x37, "DS", decimal_string(truth.axes()));
            put_spacing(truth, data);
            say(data, images[i].slice, images[i].time);
            test::write(folder / fmt::format("{:03}", i),
                        data.file(test::kMrClass, fmt::format("1.2.{}", i)));
        }
        expect_truth(folder.path(), truth);
        const auto first = decoded(folder.path());
        ASSERT_TRUE(first) << first.error().message;
        EXPECT_THAT(first->decoded.notes, Contains(HasSubstr(words)));
    }
}

} // namespace
} // namespace palpate
