// The places of the frames of DICOM files, and how they follow one another: files made at random
// from a known answer, in every encoding.

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <optional>

#include "engine/base/error.h"
#include "engine/decode/dicom_elements.h"
#include "tests/unit/io/frame_truth.h"

namespace palpate {
namespace {

using test::decimal_string;
using test::decoded;
using test::DicomData;
using test::expect_truth;
using test::Folder;
using test::image_of;
using test::put_spacing;
using test::Random;
using test::random_truth;
using test::Stored;
using test::stored_frames;
using test::Truth;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kEnhancedMrClass = "1.2.840.10008.5.1.4.1.1.4.1";
constexpr const char* kVolumeClass = "1.2.840.10008.5.1.4.1.1.6.2";

// No reference can be taken out of an item that is about to go.
template <class Item>
concept GivesItsData = requires(Item&& item) {
    *std::forward<Item>(item);
};
static_assert(GivesItsData<io::DicomItem&> && GivesItsData<const io::DicomItem&>);
static_assert(!GivesItsData<io::DicomItem> && !GivesItsData<const io::DicomItem>);

class DicomFrames : public test::FramesInFiles {};
INSTANTIATE_TEST_SUITE_P(Each, DicomFrames, test::every_encoding_and_deflated(),
                         test::encoding_name);

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

// SliceLocationVector and GridFrameOffsetVector state how far frames lie from one another, in any
// order; the frame increment names them, or nothing.
TEST_P(DicomFrames, OfOnePositionLieWhereTheirVectorSays) {
    const std::pair<uint16_t, uint16_t> vectors[] = {{0x18, 0x2005}, {0x3004, 0x000c}};
    for (uint32_t seed = 0; seed < 8; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        Truth truth = random_truth(random, false);
        const auto frames = stored_frames(random, truth, seed % 4 > 1);
        const double base = seed < 4 ? 0 : truth.step * frames.front().slice + 17.5;
        const auto [group, number] = vectors[seed % 2];
        std::vector<double> along;
        for (const Stored& frame : frames)
            along.push_back(truth.step * frame.slice + base);
        DicomData data = classic(truth, frames).erase(0x18, 0x88);
        data.put(group, number, "DS", decimal_string(along));
        data.put(0x20, 0x32, "DS", decimal_string(truth.place(frames.front().slice)));
        if (seed % 3 > 0)
            data.put_words(0x28, 9, {group, number}, "AT");
        write(data, test::kCtClass);
        expect_truth(folder_ / "a.dcm", truth);
        along.pop_back();
        EXPECT_THAT(error_of(data.put(group, number, "DS", decimal_string(along)), test::kCtClass),
                    HasSubstr(fmt::format("Vector has {} numbers for {} frames", along.size(),
                                          frames.size())));
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

// Binary numbers may be infinite or NaN: a volume with such a place has none.
TEST_P(DicomFrames, OfVolumesWhosePlaceIsNotFiniteAreAsWithoutAPlace) {
    Random random(3);
    const Truth truth = random_truth(random, false);
    const std::vector<Stored> frames = stored_frames(random, truth, true);
    const auto words = [&](const std::optional<std::vector<double>>& axes,
                           const std::optional<std::vector<double>>& position) {
        DicomData data = enhanced(truth, frames, true, Tells::index), turned, measures, shared;
        put_spacing(truth, measures);
        shared.put_items(0x28, 0x9110, {measures.put(0x18, 0x50, "DS", "1")});
        if (axes)
            shared.put_items(0x20, 0x930f, {turned.put_doubles(0x20, 0x9302, *axes)});
        if (position) {
            std::vector<DicomData> groups;
            for (size_t i = 0; i < frames.size(); ++i) {
                DicomData place, group;
                groups.push_back(
                    group.put_items(0x20, 0x930e, {place.put_doubles(0x20, 0x9301, *position)}));
            }
            data.put_items(0x5200, 0x9230, groups);
        }
        data.put_items(0x5200, 0x9229, {shared});
        write(data, kVolumeClass);
        const auto found = decoded(folder_ / "a.dcm");
        return found ? fmt::format("read: {}", fmt::join(found->decoded.warnings, "; "))
                     : found.error().message;
    };
    const std::vector<double> axes = truth.axes(), place = truth.place(0);
    const std::string no_axes = words({}, {}), no_place = words(axes, std::vector<double>());
    EXPECT_NE(no_axes, words(axes, {}));
    for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
        for (size_t at = 0; at < 6; ++at) {
            std::vector<double> damaged = axes;
            damaged[at] = wrong;
            EXPECT_EQ(words(damaged, {}), no_axes) << wrong << " at " << at;
        }
        for (size_t at = 0; at < 3; ++at) {
            std::vector<double> damaged = place;
            damaged[at] = wrong;
            EXPECT_EQ(words(axes, damaged), no_place) << wrong << " at " << at;
        }
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
        {"DiffusionBValue, then DiffusionGradientOrientation x, then",
         [](DicomData& data, int, int t) {
             std::string along;
             for (const double one : {t == 3 ? 1.0 : 0.0, t == 2 ? 1.0 : 0.0, 0.0})
                 along += test::little(std::bit_cast<uint64_t>(one), 8);
             put_private(data, 0x19, "SIEMENS MR HEADER", 0x0c, "IS", t == 0 ? "0" : "1000");
             if (t > 0)
                 put_private(data, 0x19, "SIEMENS MR HEADER", 0x0e, "FD", along);
         }},
        {"DiffusionBValue, then DiffusionGradientOrientation x, then",
         [](DicomData& data, int, int t) {
             put_private(data, 0x43, "GEMS_PARM_01", 0x39, "IS", t == 0 ? "0" : "1000");
             put_private(data, 0x19, "GEMS_ACQU_01", 0xbb, "DS", t == 3 ? "1" : "0");
             put_private(data, 0x19, "GEMS_ACQU_01", 0xbc, "DS", t == 2 ? "1" : "0");
             put_private(data, 0x19, "GEMS_ACQU_01", 0xbd, "DS", t == 1 ? "1" : "0");
         }},
        {"DiffusionBValue, then DiffusionGradientOrientation x, then",
         [](DicomData& data, int, int t) {
             const auto single = [](bool one) {
                 return test::little(std::bit_cast<uint32_t>(one ? 1.0f : 0.0f), 4);
             };
             put_private(data, 0x2001, "Philips Imaging DD 001", 0x03, "FL",
                         test::little(std::bit_cast<uint32_t>(t == 0 ? 0.0f : 1000.0f), 4));
             put_private(data, 0x2005, "Philips MR Imaging DD 001", 0xb0, "FL", single(t == 3));
             put_private(data, 0x2005, "Philips MR Imaging DD 001", 0xb1, "FL", single(t == 2));
             put_private(data, 0x2005, "Philips MR Imaging DD 001", 0xb2, "FL", single(t == 1));
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
                        file_of(data, test::kMrClass, fmt::format("1.2.{}", i)));
        }
        expect_truth(folder.path(), truth);
        const auto first = decoded(folder.path());
        ASSERT_TRUE(first) << first.error().message;
        EXPECT_THAT(first->decoded.notes, Contains(HasSubstr(words)));
    }
}

} // namespace
} // namespace palpate
