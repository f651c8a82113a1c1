// ImageJ and OME state these in TIFF files: slices, channels, times and spacing.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/volume/grid.h"
#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/tiff_bytes.h"

namespace palpate::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr Sizes kSizes{5, 4, 3, 1};

// Every frame, and the sentence where none is chosen.
void expect_frames(const std::filesystem::path& path, int channels, int times,
                   glm::dvec3 spacing_mm, const std::string& what) {
    SCOPED_TRACE(what);
    for (int frame = 0; frame < channels * times; ++frame) {
        const auto result = decode_here(path, static_cast<uint32_t>(frame));
        ASSERT_TRUE(result) << result.error().message;
        EXPECT_EQ(result->decoded.grid.size, glm::uvec3(kSizes.x, kSizes.y, kSizes.z));
        EXPECT_EQ(result->values, frame_of(kSizes, frame)) << frame;
        EXPECT_THAT(result->decoded.warnings, IsEmpty());
        const glm::dmat4& m = result->decoded.grid.world_from_index;
        for (int axis = 0; axis < 3; ++axis) // a quotient of two whole numbers, and a product
            EXPECT_NEAR(m[axis][axis], spacing_mm[axis], 1e-14 * spacing_mm[axis]);
    }
    EXPECT_THAT(decode_here(path, static_cast<uint32_t>(channels * times)).error().message,
                HasSubstr("no frame"));
    const auto first = decode_here(path);
    ASSERT_TRUE(first);
    if (channels * times == 1) {
        EXPECT_THAT(first->decoded.warnings, IsEmpty());
    } else {
        EXPECT_THAT(first->decoded.warnings, ElementsAre(HasSubstr("the first is read")));
    }
}

std::string imagej(int channels, int times, const std::string& more) {
    return fmt::format("ImageJ=1.53t\nimages={}\n", kSizes.z * channels * times) +
           (channels > 1 ? fmt::format("channels={}\n", channels) : "") +
           fmt::format("slices={}\n", kSizes.z) +
           (times > 1 ? fmt::format("frames={}\n", times) : "") +
           "hyperstack=true\nmode=grayscale\n" + more + "loop=false\nmin=0.0\nmax=120.0\n";
}

TEST(TiffOfImageJ, HyperstacksAreReadByChannelAndTime) {
    const TemporaryFolder folder;
    for (const int channels : {1, 2, 3})
        for (const int times : {1, 2})
            for (const bool big : {false, true})
                for (const bool tags : {true, false}) {
                    TiffBytes tiff{.big_endian = big, .pages_have_tags = tags};
                    tiff.description = imagej(channels, times, "unit=mm\nspacing=2.5\n");
                    tiff.x_pixels = 4; // pixels in 2 mm
                    tiff.x_of = 2;
                    tiff.y_pixels = 5;
                    tiff.unit = 1;
                    const auto path = folder.write(
                        "a.tif",
                        tiff.file(kSizes.x, kSizes.y, pages_of(kSizes, channels, times, "czt")));
                    expect_frames(path, channels, times, {0.5, 0.2, 2.5},
                                  fmt::format("{} channels, {} times, big {}, tags {}", channels,
                                              times, big, tags));
                }
}

TEST(TiffOfImageJ, SpacingIsInTheUnitStated) {
    const TemporaryFolder folder;
    struct Case {
        const char* lines;
        int unit;
        double x_mm, z_mm;
    };
    const Case cases[] = {{"unit=um\nspacing=20.0\n", 1, 0.01, 0.02},
                          {"unit=\\u00B5m\nspacing=20\n", 1, 0.01, 0.02},
                          {"unit=micron\nspacing=-20\n", 1, 0.01, 0.02},
                          {"unit=\xc2\xb5m\nspacing=20\n", 1, 0.01, 0.02},
                          {"unit=nm\nspacing=20\n", 1, 1e-5, 2e-5},
                          {"unit=cm\nspacing=20\n", 3, 100, 200},
                          {"unit=inch\nspacing=2\n", 2, 254, 50.8},
                          {"spacing=2\n", 3, 100, 20},
                          {"spacing=2\n", 2, 254, 50.8},
                          {"unit=mm\nyunit=mm\nzunit=um\nspacing=500\n", 1, 10, 0.5}};
    for (const Case& c : cases) {
        TiffBytes tiff{.description = imagej(1, 1, c.lines)};
        tiff.x_pixels = tiff.y_pixels = 1; // a pixel in ten units
        tiff.x_of = tiff.y_of = 10;
        tiff.unit = c.unit;
        const auto path =
            folder.write("a.tif", tiff.file(kSizes.x, kSizes.y, pages_of(kSizes, 1, 1, "czt")));
        expect_frames(path, 1, 1, {c.x_mm, c.x_mm, c.z_mm}, c.lines);
    }
}

TEST(TiffOfImageJ, ThatDoesNotFitIsToldAndReadAsSlices) {
    const TemporaryFolder folder;
    const auto decode = [&](const std::string& description, int pages, bool tags = true) {
        TiffBytes tiff{.description = description, .pages_have_tags = tags};
        tiff.x_pixels = tiff.y_pixels = 2;
        tiff.unit = 1;
        auto all = pages_of(kSizes, 2, 1, "czt");
        all.resize(static_cast<size_t>(pages));
        return decode_here(folder.write("a.tif", tiff.file(kSizes.x, kSizes.y, all)));
    };
    const auto fewer = decode(imagej(2, 1, "unit=mm\nspacing=1\n"), 5);
    ASSERT_TRUE(fewer) << fewer.error().message;
    EXPECT_EQ(fewer->decoded.grid.size.z, 5u);
    EXPECT_THAT(fewer->decoded.warnings, ElementsAre(HasSubstr("the file has 5 pages")));
    const auto one = decode(imagej(2, 1, "unit=mm\nspacing=1\n"), 1);
    ASSERT_TRUE(one) << one.error().message;
    EXPECT_THAT(one->decoded.warnings, ElementsAre(HasSubstr("the file has one page")));
    const auto odd = decode(imagej(1, 1, "unit=parsec\nspacing=1\n"), 3);
    EXPECT_THAT(odd->decoded.warnings, ElementsAre(HasSubstr("found \"parsec\"")));
    const auto none = decode(imagej(1, 1, "unit=pixel\nspacing=1\n"), 3);
    EXPECT_THAT(none->decoded.warnings, ElementsAre(HasSubstr("do not state their spacing")));
    EXPECT_EQ(decode("ImageJ=1.11a\nimages=3\nunit=mm\nspacing=4\n", 3)->decoded.grid.size.z, 3u);
    // Hostile numbers.
    for (const char* count : {"2147483647", "99999999999999999999", "-5", "0", "nan"}) {
        const auto result = decode(fmt::format("ImageJ=1\nimages={0}\nchannels={0}\nslices={0}\n"
                                               "frames={0}\nunit=mm\nspacing={0}\n",
                                               count),
                                   3);
        ASSERT_TRUE(result) << result.error().message;
        EXPECT_EQ(result->decoded.grid.size.z, 3u) << count;
    }
}

// ImageJ stores signed values as unsigned ones with a straight line.
TEST(TiffOfImageJ, CalibrationByALineIsAppliedToValues) {
    const TemporaryFolder folder;
    TiffBytes tiff{.description = imagej(1, 1, "cf=0\nc0=-32768.0\nc1=1.0\nvunit=Gray Value\n")};
    const auto result = decode_here(
        folder.write("a.tif", tiff.file(kSizes.x, kSizes.y, pages_of(kSizes, 1, 1, "czt"))));
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(result->decoded.rescale, (std::vector<Rescale>{{1, -32768}}));
}

std::string ome(int channels, int times, const std::string& order, const std::string& pixels,
                const std::string& data) {
    return fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><OME xmlns=\"http://www.openmicroscopy.org/"
        "Schemas/OME/2016-06\"><Image ID=\"Image:0\"><Pixels ID=\"Pixels:0\" "
        "DimensionOrder=\"XY{}\" "
        "SizeX=\"{}\" SizeY=\"{}\" SizeZ=\"{}\" SizeC=\"{}\" SizeT=\"{}\" Type=\"uint16\" {}>{}"
        "</Pixels></Image></OME>",
        order, kSizes.x, kSizes.y, kSizes.z, channels, times, pixels, data);
}

TEST(TiffOfOme, PlanesAreFoundInEveryOrder) {
    const TemporaryFolder folder;
    const std::string size =
        "PhysicalSizeX=\"0.5\" PhysicalSizeXUnit=\"mm\" PhysicalSizeY=\"200\" "
        "PhysicalSizeZ=\"0.25\" PhysicalSizeZUnit=\"cm\"";
    for (const std::string order : {"ZCT", "ZTC", "CZT", "CTZ", "TZC", "TCZ"})
        for (const int times : {1, 2})
            for (const bool big_tiff : {false, true})
                for (const int data : {0, 1, 2}) {
                    const int channels = 2;
                    std::string tags = "<Channel ID=\"Channel:0\" SamplesPerPixel=\"1\"/>";
                    std::string lower = order;
                    for (char& c : lower)
                        c = static_cast<char>(std::tolower(c));
                    const auto pages = pages_of(kSizes, channels, times, lower);
                    std::vector<std::vector<int>> stored = pages;
                    if (data == 1)
                        tags += "<TiffData IFD=\"0\" PlaneCount=\"" + std::to_string(pages.size()) +
                                "\"/>";
                    if (data == 2) { // each plane by itself, the last first
                        std::reverse(stored.begin(), stored.end());
                        for (size_t p = 0; p < pages.size(); ++p) {
                            size_t rest = p, at[3]{};
                            for (const char axis : lower) {
                                const auto n = static_cast<size_t>(axis == 'z'   ? kSizes.z
                                                                   : axis == 'c' ? channels
                                                                                 : times);
                                at[axis == 'z' ? 0 : axis == 'c' ? 1 : 2] = rest % n;
                                rest /= n;
                            }
                            tags += fmt::format(
                                "<TiffData FirstZ=\"{}\" FirstC=\"{}\" FirstT=\"{}\" IFD=\"{}\">"
                                "<UUID FileName=\"a.ome.tif\">urn:uuid:1</UUID></TiffData>",
                                at[0], at[1], at[2], pages.size() - 1 - p);
                        }
                    }
                    TiffBytes tiff{.big_endian = times == 2, .big_tiff = big_tiff};
                    tiff.description = ome(channels, times, order, size, tags);
                    expect_frames(folder.write("a.ome.tif", tiff.file(kSizes.x, kSizes.y, stored)),
                                  channels, times, {0.5, 0.2, 2.5}, order + std::to_string(data));
                }
}

TEST(TiffOfOme, ThatDoesNotFitIsRefusedByCause) {
    const TemporaryFolder folder;
    const auto refusal = [&](const std::string& description) {
        const TiffBytes tiff{.description = description};
        const auto result = decode_here(
            folder.write("a.tif", tiff.file(kSizes.x, kSizes.y, pages_of(kSizes, 2, 1, "zct"))));
        return result ? "not refused" : result.error().message;
    };
    const auto with = [](const std::string& data, int channels = 2) {
        return ome(channels, 1, "ZCT", "", data);
    };
    EXPECT_EQ(refusal(with("")), "not refused");
    EXPECT_EQ(refusal("<OME"), "not refused"); // damaged: left out with a warning
    EXPECT_THAT(refusal(with("", 3)), HasSubstr("at most the 6 pages"));
    EXPECT_THAT(refusal(with("", 2147483647)), HasSubstr("at most the 6 pages"));
    EXPECT_THAT(refusal(with("", -1)), HasSubstr("sizes above 0"));
    EXPECT_THAT(refusal(ome(2, 1, "ZCX", "", "")), HasSubstr("an order such as XYZCT"));
    EXPECT_THAT(refusal(with("<TiffData IFD=\"0\" PlaneCount=\"2\"/>")),
                HasSubstr("which page is slice 2 of channel 0"));
    EXPECT_THAT(refusal(with("<TiffData IFD=\"4\" PlaneCount=\"6\"/>")), HasSubstr("found 9"));
    EXPECT_THAT(refusal(with("<TiffData FirstZ=\"3\"/>")), HasSubstr("planes within 3 slices"));
    EXPECT_THAT(refusal(with("<TiffData IFD=\"-1\"/>")), HasSubstr("planes within 3 slices"));
    EXPECT_THAT(
        refusal(with("<TiffData IFD=\"0\" PlaneCount=\"3\"><UUID FileName=\"a.tif\"/></TiffData>"
                     "<TiffData FirstC=\"1\" IFD=\"0\" PlaneCount=\"3\"><UUID "
                     "FileName=\"b.tif\"/></TiffData>")),
        HasSubstr("names 2 files with planes, such as a.tif"));
}

} // namespace
} // namespace palpate::io
