// The program on DICOM series and segmentations, made byte by byte.

#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/image/exr.h"
#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "tests/support/program.h"
#include "tests/unit/io/dicom_bytes.h"

namespace palpate {
namespace {

using nlohmann::json;
using test::DicomData;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// CIE L*a*b* as DICOM stores it: L* 100, a* and b* 0; the green of sRGB (87.7, -86.2, 83.2).
const std::vector<uint16_t> kWhite{65535, 32896, 32896}, kGreen{57470, 10743, 54279};

class DicomCommands : public ProgramTest {
 protected:
    // A segment in the upper half of one frame of 8 x 4 samples, where test::dicom_slice lies.
    void write_segmentation(const std::string& name, const std::vector<uint16_t>& lab) const {
        DicomData data = test::samples(8, 4, 1, 1, false), segment, position, axes, measures, id;
        data.put(8, 0x60, "CS", "SEG").put(0x20, 0x0e, "UI", "1.2.9").put(0x62, 1, "CS", "BINARY");
        segment.put_words(0x62, 4, {7}).put(0x62, 5, "LO", "left \x1b[31mkidney");
        segment.put_words(0x62, 0xd, lab);
        position.put(0x20, 0x32, "DS", "-10\\20\\0");
        axes.put(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0");
        measures.put(0x28, 0x30, "DS", "0.75\\0.5").put(0x18, 0x88, "DS", "2.5");
        id.put_words(0x62, 0xb, {7});
        DicomData groups;
        groups.put_items(0x20, 0x9113, {position}).put_items(0x20, 0x9116, {axes});
        groups.put_items(0x28, 0x9110, {measures}).put_items(0x62, 0xa, {id});
        data.put_items(0x62, 2, {segment}).put_items(0x5200, 0x9230, {groups});
        data.put(0x7fe0, 0x10, "OB", std::string("\xff\xff\0\0", 4));
        write(name, data.file(test::kSegClass, "1.2.9.1"));
    }
    void write_slices(const std::vector<double>& z_mm) const {
        std::filesystem::create_directories(file("ct/a"));
        for (size_t i = 0; i < z_mm.size(); ++i)
            write(
                fmt::format("ct/a/{}.dcm", i),
                test::dicom_slice(static_cast<int>(i) + 1, z_mm[i] / (static_cast<double>(i) + 1)));
    }
};

TEST_F(DicomCommands, InfoNamesTheSegmentsOfASegmentation) {
    write_segmentation("seg.dcm", kWhite);
    const ProgramRun text = run({"info", "--labels", file("seg.dcm").string()});
    EXPECT_EQ(text.exit_code, 0) << text.messages;
    EXPECT_THAT(text.output, AllOf(HasSubstr("size       8 x 4 x 1"), HasSubstr("label 7"),
                                   HasSubstr("kidney (#ffffff)"), Not(HasSubstr("\x1b"))));
    const ProgramRun said = run({"info", "--json", file("seg.dcm").string()});
    EXPECT_EQ(said.exit_code, 0) << said.messages;
    const json labels = json::parse(said.output)["labels"];
    ASSERT_EQ(labels.size(), 1u);
    EXPECT_EQ(labels[0]["label"], 7);
    EXPECT_NEAR(labels[0]["color"][1].get<double>(), 1.0, 1e-3); // the matrix has seven digits
}

TEST_F(DicomCommands, ConvertKeepsNamesOfLabelsOrSaysThatTheyAreLost) {
    const char* const kLost = "does not hold the names and colours of the 1 segment of";
    write_segmentation("seg.dcm", kWhite);
    for (const auto& [name, keeps] : {std::pair("labels.nii", true), {"labels.mha", false}}) {
        SCOPED_TRACE(name);
        const ProgramRun ran =
            run({"convert", "--labels", file("seg.dcm").string(), file(name).string()});
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        EXPECT_EQ(ran.messages.find(kLost) == std::string::npos, keeps) << ran.messages;
        const Result<LoadedVolume> labels = load_labels(file(name));
        ASSERT_TRUE(labels) << labels.error().message;
        EXPECT_EQ(labels->volume.value({3, 1, 0}), 7.0f);
        EXPECT_EQ(labels->volume.value({3, 2, 0}), 0.0f);
        ASSERT_EQ(labels->labels.size(), keeps ? 1u : 0u);
        if (keeps) {
            EXPECT_THAT(labels->labels[0].name, HasSubstr("kidney"));
        }
    }
}

TEST_F(DicomCommands, RenderTakesTheColoursOfASegmentation) {
    write_slices({0, 2.5, 5});
    for (const bool green : {false, true}) {
        write_segmentation("seg.dcm", green ? kGreen : kWhite);
        const ProgramRun ran =
            run({"render", file("ct").string(), "--labels", file("seg.dcm").string(), "--surface",
                 "labels", "--mode", "mip", "--window", "5000,6000", "--size", "32,24", "-o",
                 file("picture.exr").string()});
        ASSERT_EQ(ran.exit_code, 0) << ran.messages;
        const Result<ExrFile> picture = load_exr(file("picture.exr"));
        ASSERT_TRUE(picture) << picture.error().message;
        const Image& image = picture->image;
        float most[3] = {};
        for (size_t c = 0; c < 3; ++c) {
            const auto at =
                std::find(image.channels.begin(), image.channels.end(), std::string(1, "RGB"[c]));
            ASSERT_NE(at, image.channels.end());
            for (uint32_t y = 0; y < image.size_px.y; ++y)
                for (uint32_t x = 0; x < image.size_px.x; ++x)
                    most[c] = std::max(
                        most[c], image.at(x, y, static_cast<size_t>(at - image.channels.begin())));
        }
        EXPECT_GT(most[1], 0.2f);
        if (green) {
            EXPECT_LT(most[0], 0.1f * most[1]);
            EXPECT_LT(most[2], 0.1f * most[1]);
        } else {
            EXPECT_NEAR(most[0], most[1], 0.01f);
            EXPECT_NEAR(most[2], most[1], 0.01f);
        }
    }
}

TEST_F(DicomCommands, UnevenSlicesAreRefusedInWordsAndResampledOnRequest) {
    write_slices({4, 8, 12, 13.5, 19.5, 25.5});
    const ProgramRun refused = run({"info", file("ct").string()});
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_THAT(refused.messages, AllOf(HasSubstr("3 slices 4 mm apart (at 4 .. 12 mm)"),
                                        HasSubstr("a gap of 1.5 mm"),
                                        HasSubstr("3 slices 6 mm apart (at 13.5 .. 25.5 mm)"),
                                        HasSubstr("--resample-slices")));
    const ProgramRun ran = run({"info", "--json", "--resample-slices", file("ct").string()});
    EXPECT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_THAT(ran.messages, HasSubstr("7 slices 3.583 mm apart"));
    EXPECT_EQ(json::parse(ran.output)["size"], json({8, 4, 7}));
}

TEST_F(DicomCommands, AWrittenSceneKeepsThatSlicesAreResampled) {
    write_slices({4, 8, 12, 13.5, 19.5, 25.5});
    const auto draw = [&](std::vector<std::string> words) {
        words.insert(words.begin(), "render");
        const ProgramRun ran = run(words);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
    };
    const std::string scene = file("scene.json").string();
    draw({file("ct").string(), "--resample-slices", "--mode", "mip", "--size", "16,12", "-o",
          file("a.exr").string(), "--write-scene", scene});
    EXPECT_EQ(json::parse(bytes_of("scene.json"))["resample_slices"], true);
    draw({scene, "-o", file("b.exr").string()});
    // The files name their scenes, which name the folder differently.
    EXPECT_EQ(load_exr(file("a.exr"))->image.samples, load_exr(file("b.exr"))->image.samples);
}

TEST_F(DicomCommands, ResamplingOfOtherVolumesIsSaidToDoNothing) {
    const Volume volume = make_volume(make_grid({3, 3, 3}, {1, 1, 1}), ScalarType::i16,
                                      [](glm::uvec3 i) { return i.x; });
    for (const std::string name : {"v.nrrd", "v.pbv"}) {
        ASSERT_TRUE(save_volume(file(name), volume));
        const ProgramRun ran = run({"info", "--resample-slices", file(name).string()});
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        EXPECT_THAT(ran.messages, AllOf(HasSubstr("warning"), HasSubstr("has no effect"))) << name;
    }
    EXPECT_THAT(run({"info", "--resample-slices", "synthetic:ball?size=8"}).messages,
                HasSubstr("has no effect"));
}

// Small values of a MONOCHROME1 are bright, which no other format states: each command that writes
// or feels its values says so, and says nothing of the same values as MONOCHROME2.
TEST_F(DicomCommands, WhatAMonochrome1LosesIsSaid) {
    for (const bool inverted : {true, false}) {
        DicomData data = test::samples(8, 4, 16, 16, false);
        test::place(data, "0\\0\\0", "1\\0\\0\\0\\1\\0", "1\\1");
        std::vector<int> values(8 * 4);
        for (int i = 0; i < 32; ++i)
            values[static_cast<size_t>(i)] = 100 * (i % 8);
        data.put(0x28, 4, "CS", inverted ? "MONOCHROME1" : "MONOCHROME2");
        data.put(0x7fe0, 0x10, "OW", test::words_16(values));
        write("in.dcm", data.file(test::kCtClass, "1.2.5"));
        const std::string in = file("in.dcm").string();
        const auto said = [&](const std::vector<std::string>& command) {
            const ProgramRun ran = run(command);
            EXPECT_EQ(ran.exit_code, 0) << ran.messages;
            return ran.messages;
        };
        const auto expect_loss = [&](const std::string& messages, const std::string& out) {
            const std::string lost = fmt::format(
                "{}: does not hold that small values are bright (MONOCHROME1 of {})", out, in);
            EXPECT_EQ(messages.find(lost) != std::string::npos, inverted) << messages;
        };
        for (const char* name : {"out.nrrd", "out.pbv"}) {
            const std::string out = file(name).string();
            expect_loss(said({"convert", in, out}), out);
            expect_loss(said({"filter", in, "--flip", "x", "-o", out}), out);
            // A result that is no grey value any more, and labels, have no bright side.
            EXPECT_THAT(said({"filter", in, "--threshold", "350", "-o", out}),
                        Not(HasSubstr("MONOCHROME1")));
            EXPECT_THAT(said({"convert", "--labels", in, out}), Not(HasSubstr("MONOCHROME1")));
        }
        write("path.csv", "time_s,x_mm,y_mm,z_mm\n0,4,2,5\n0.1,4,2,0\n");
        const std::vector<std::string> touch{
            "touch", in, "--path", file("path.csv").string(), "--device", "exact"};
        const std::string felt = said(touch);
        EXPECT_EQ(
            felt.find("its bright parts are small values (MONOCHROME1), which feel like air") !=
                std::string::npos,
            inverted)
            << felt;
        std::vector<std::string> of_iso = touch; // a person who says what is solid knows it
        of_iso.insert(of_iso.end(), {"--iso", "350"});
        EXPECT_THAT(said(of_iso), Not(HasSubstr("MONOCHROME1")));
    }
}

} // namespace
} // namespace palpate
