// The picture that palpate render draws when nobody says how.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

#include "engine/image/exr.h"
#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class DefaultPicture : public ProgramTest {
 protected:
    // Writes an NRRD file of 16-bit samples; directions are the world's steps from sample to
    // sample.
    std::string write_volume(const std::string& name, glm::uvec3 size,
                             const std::string& directions,
                             const std::function<double(glm::dvec3)>& value,
                             const char* type = "int16") const {
        std::ofstream out(file(name), std::ios::binary);
        out << "NRRD0004\ntype: " << type << "\ndimension: 3\n"
            << "space: left-posterior-superior\nsizes: " << size.x << ' ' << size.y << ' ' << size.z
            << "\nspace directions: " << directions
            << "\nspace origin: (0,0,0)\nencoding: raw\nendian: little\n\n";
        for (uint32_t z = 0; z < size.z; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x) {
                    const auto v = static_cast<int16_t>(std::lround(value({x, y, z})));
                    out.write(reinterpret_cast<const char*>(&v), sizeof v);
                }
        return file(name).string();
    }
    static std::string cubic(double spacing_mm) {
        return fmt::format("({0},0,0) (0,{0},0) (0,0,{0})", spacing_mm);
    }

    struct Picture {
        Image image;
        std::string messages;
        double at(uint32_t x, uint32_t y, const char* channel) const {
            return image.at(x, y, *channel_index(image, channel));
        }
        // The share of pixels that `is` holds for; is(r, g, b).
        double share(const std::function<bool(glm::dvec3)>& is) const {
            double count = 0;
            for (uint32_t y = 0; y < image.size_px.y; ++y)
                for (uint32_t x = 0; x < image.size_px.x; ++x)
                    count += is({at(x, y, "R"), at(x, y, "G"), at(x, y, "B")}) ? 1 : 0;
            return count / (image.size_px.x * image.size_px.y);
        }
    };
    Picture draw(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), "render");
        arguments.insert(arguments.end(), {"--size", "64,64", "-o", file("p.exr").string()});
        const ProgramRun ran = run(arguments);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        Result<ExrFile> read = load_exr(file("p.exr"));
        EXPECT_TRUE(read);
        return {read ? std::move(read->image) : Image{}, ran.messages};
    }
    static double rmse(const Picture& a, const Picture& b) {
        double sum = 0;
        for (uint32_t y = 0; y < 64; ++y)
            for (uint32_t x = 0; x < 64; ++x)
                for (const char* c : {"R", "G", "B"})
                    sum += std::pow(a.at(x, y, c) - b.at(x, y, c), 2);
        return std::sqrt(sum / (3 * 64 * 64));
    }
};

bool seen(glm::dvec3 color) {
    return glm::length(color) > 0.05;
}

// A ball in HU: `inside` within `radius` samples of the middle of 40^3 samples, else air; its edge
// takes two samples.
std::function<double(glm::dvec3)> ball(double inside, double radius) {
    return [=](glm::dvec3 at) {
        const double depth = radius - glm::length(at - 19.5);
        return -1000.0 + (inside + 1000.0) * std::clamp(0.5 + 0.5 * depth, 0.0, 1.0);
    };
}

TEST_F(DefaultPicture, AVolumeOneSampleThickIsDrawnAsItsSliceStraightOrTilted) {
    const auto stripes = [](glm::dvec3 at) { return 200.0 * (std::sin(at.x + at.y) + 1.0); };
    for (const char* directions :
         {"(1,0,0) (0,1,0) (0,0,5)", "(0.8,0,0.6) (0,1,0) (-3,0,4)",
          "(0.36,0.48,-0.8) (-0.8,0.6,0) (2.4,3.2,3)", "(0.1,0,0.02) (0,0.1,0.03) (0,0,2)"}) {
        const std::string volume = write_volume("slice.nrrd", {90, 80, 1}, directions, stripes);
        const Picture picture = draw({volume});
        EXPECT_THAT(picture.messages, HasSubstr("one sample thick, so it is drawn as a slice"));
        // The stripes are dark for less than half of their length; 80 / 90 of the square is slice.
        EXPECT_GT(picture.share(seen), 0.4) << directions;
        EXPECT_EQ(picture.share([](glm::dvec3 c) { return std::isnan(c.x); }), 0.0);
    }
    const std::string turned =
        write_volume("x.nrrd", {1, 80, 90}, "(3,0,0) (0,1,0) (0,0,1)", [&](glm::dvec3 at) {
            return stripes({at.y, at.z, 0});
        });
    EXPECT_GT(draw({turned}).share(seen), 0.4) << "thin along x";
    EXPECT_THAT(draw({turned, "--mode", "alpha"}).messages, Not(HasSubstr("as a slice")));
}

TEST_F(DefaultPicture, PresetsAreAsOpaqueForASmallBodyAsForALargeOne) {
    std::vector<Picture> pictures;
    for (const double spacing_mm : {2.0, 0.05, 0.01})
        pictures.push_back(
            draw({write_volume("ball.nrrd", glm::uvec3(40), cubic(spacing_mm), ball(600, 14))}));
    // The diagonals are 139, 3.5 and 0.7 mm: less than 200, so that opacity is by size alone and
    // only rounding differs.
    EXPECT_LT(rmse(pictures[0], pictures[1]), 1e-3);
    EXPECT_LT(rmse(pictures[0], pictures[2]), 1e-3);
    EXPECT_GT(pictures[2].share(seen), 0.1);

    // A function that is given keeps its opacity per millimetre.
    std::ofstream(file("tf.json")) << R"({"colors": [[0, 1, 1, 1]],
                                          "opacities": [[0, 0], [500, 0.01]]})";
    const std::string small = write_volume("ball.nrrd", glm::uvec3(40), cubic(0.01), ball(600, 14));
    const std::string scene = file("scene.json").string();
    EXPECT_EQ(
        draw({small, "--mode", "alpha", "--tf", file("tf.json").string(), "--write-scene", scene})
            .share(seen),
        0.0);
    const auto unit = [&] {
        return nlohmann::json::parse(
                   bytes_of("scene.json"))["ray_cast"]["transfer"]["opacity_unit_mm"]
            .get<double>();
    };
    EXPECT_EQ(unit(), 1.0);
    draw({small, "--write-scene", scene});
    EXPECT_NEAR(unit(), 0.4 * std::sqrt(3.0) / 200.0, 1e-12);
    std::ofstream(file("named.json"))
        << R"({"volume": "ball.nrrd", "ray_cast": {"transfer": "ct-bone"}})";
    EXPECT_GT(draw({file("named.json").string()}).share(seen), 0.1) << "named by a scene";
}

TEST_F(DefaultPicture, AMipOfACtIsNeitherNearlyBlackNorBurntOut) {
    // A trunk: bone of 250 .. 600 HU in soft tissue, and one speck of metal.
    const auto trunk = [](glm::dvec3 at) {
        if (at == glm::dvec3(20, 20, 20))
            return 3071.0;
        const double bone = ball(600, 6)(at);
        return std::max(ball(40, 18)(at), bone);
    };
    const Picture dim =
        draw({write_volume("trunk.nrrd", glm::uvec3(40), cubic(8), trunk), "--mode", "mip"});
    // 5 % of the rays along the axes that meet the body are white; from another side, some more or
    // less.
    EXPECT_GT(dim.share([](glm::dvec3 c) { return c.x > 0.9; }), 0.03 * dim.share(seen));

    // A head: a shell of 1200 .. 2900 HU.
    const auto head = [](glm::dvec3 at) {
        const double r = glm::length(at - 19.5);
        return r > 18 ? -1000.0 : r > 14 ? 1200.0 + 43.6 * at.z : 40.0;
    };
    const Picture bright =
        draw({write_volume("head.nrrd", glm::uvec3(40), cubic(5), head), "--mode", "mip"});
    const double body = bright.share(seen);
    EXPECT_GT(body, 0.2);
    // 5 % of the rays along the axes are clipped; from another side, some more or less.
    EXPECT_LT(bright.share([](glm::dvec3 c) { return c.x > 0.999; }), 0.1 * body);
}

TEST_F(DefaultPicture, NothingIsClippedByTheLight) {
    const std::string volume = write_volume("ball.nrrd", glm::uvec3(40), cubic(5), ball(1000, 15));
    const Picture picture = draw({volume, "--iso", "0", "--view", "front"});
    // The red of an iso-surface is 1: lit by 0.2 + 0.65 cos + 0.15 cos^10 it reaches 1 only where
    // the surface faces the eye. 0.99 is reached up to an angle a with 0.65 (1 - cos a) + 0.15 (1 -
    // cos^10 a) = 0.01, that is 5.5 degrees: 0.9 % of the ball's disc.
    const double disc = picture.share(seen);
    EXPECT_GT(disc, 0.2);
    EXPECT_GT(picture.share([](glm::dvec3 c) { return c.x > 0.9; }), 0.0);
    EXPECT_LT(picture.share([](glm::dvec3 c) { return c.x > 0.99; }), 0.03 * disc);
}

TEST_F(DefaultPicture, AlphaErrsLessThanAtOneSampleAVoxel) {
    const std::string volume = write_volume("ball.nrrd", glm::uvec3(40), cubic(5), ball(1000, 15));
    const Picture exact = draw({volume, "--integrator", "exact", "--sub-steps", "64"});
    // At an edge a midpoint rule errs in proportion to its step: by half of it at half a voxel. A
    // quarter more is left for what does not depend on the step, the normals that `exact` takes.
    EXPECT_LT(rmse(draw({volume}), exact), 0.75 * rmse(draw({volume, "--step", "5"}), exact));
}

TEST_F(DefaultPicture, WhatCanBeSeenFillsThePictureAndNoneOfItIsCut) {
    // A ball of 12 samples in a corner of 80^3, and a volume that is full.
    const std::string corner = write_volume("corner.nrrd", glm::uvec3(80), cubic(3),
                                            [](glm::dvec3 at) { return ball(600, 12)(at + 4.0); });
    const std::string full = write_volume("full.nrrd", {50, 20, 30}, cubic(5), [](glm::dvec3 at) {
        return 500.0 + 100.0 * std::sin(at.x);
    });
    for (const auto& [volume, mode] :
         {std::pair(corner, "alpha"), {corner, "mip"}, {corner, "iso"}, {full, "alpha"}}) {
        const Picture picture = draw({volume, "--mode", mode, "--tf", "ct-bone"});
        const auto any = [&](uint32_t from, uint32_t to, bool column) {
            for (uint32_t i = from; i < to; ++i)
                for (uint32_t j = 0; j < 64; ++j)
                    if (picture.at(column ? i : j, column ? j : i, "R") > 0.05)
                        return true;
            return false;
        };
        for (const bool column : {false, true}) {
            EXPECT_FALSE(any(0, 1, column) || any(63, 64, column)) << volume << ' ' << mode;
            // The ball's 24 samples lie in blocks of 32. An oblique cube is up to sqrt(3) sides
            // high, and that is 0.94 of the picture's 64 pixels: the ball has at least 24 / 32
            // of 35.
            const int across = any(20, 24, column) + any(40, 44, column);
            EXPECT_EQ(across, 2) << volume << ' ' << mode;
        }
    }
}

TEST_F(DefaultPicture, OneValueEverywhereIsSaid) {
    const auto flat = [](glm::dvec3) { return 7.0; };
    EXPECT_THAT(draw({write_volume("flat.nrrd", glm::uvec3(9), cubic(2), flat)}).messages,
                HasSubstr("all samples are 7, so there is nothing to see"));
}

// A ball of two fifths of the volume's side, beside its middle: the camera comes to it. What it
// fits are boxes of cells of 8 samples, here of 48 samples at most about the ball's 33, of which
// the ball's disc is (33 / 48)^2 pi / 4; the box's corners seen obliquely make it up to half as
// small.
TEST_F(DefaultPicture, TheCameraFitsWhatCanBeSeenAndNotTheBox) {
    const auto body = [](glm::dvec3 at) {
        const double depth = 16.0 - glm::length(at - glm::dvec3(28, 52, 40));
        return -1000.0 + 1600.0 * std::clamp(0.5 + 0.5 * depth, 0.0, 1.0);
    };
    const std::string volume = write_volume("corner.nrrd", glm::uvec3(80), cubic(2), body);
    for (const std::vector<std::string>& how : {std::vector<std::string>{volume, "--iso", "300"},
                                                {volume, "--mode", "alpha", "--tf", "ct-bone"}}) {
        const Picture fitted = draw(how);
        std::vector<std::string> box = how;
        box.insert(box.end(), {"--view", "oblique"}); // which looks at the whole box
        EXPECT_GT(fitted.share(seen), 2.0 * draw(box).share(seen));
        EXPECT_GT(fitted.share(seen), 0.18);
        for (uint32_t i = 0; i < 64; ++i) // whole, with a margin on every side
            for (const glm::uvec2 at : {glm::uvec2(i, 0), {i, 63}, {0, i}, {63, i}})
                ASSERT_FALSE(seen({fitted.at(at.x, at.y, "R"), fitted.at(at.x, at.y, "G"),
                                   fitted.at(at.x, at.y, "B")}));
    }
}

// A CT whose file lacks the rescale of its values, HU + 1024 as they are stored: at 300 skin would
// be drawn as bone.
TEST_F(DefaultPicture, ACtWithoutRescaleIsSaid) {
    const auto head = [](double offset) {
        return make_volume(make_grid(glm::uvec3(40), glm::dvec3(3.0)), ScalarType::i16,
                           [=](glm::uvec3 i) {
                               const double r = glm::length(glm::dvec3(i) - 19.5);
                               return offset + (r > 19.0 ? -1000 : r > 15 ? 900 : 40);
                           });
    };
    for (const char* name : {"ct.nrrd", "ct.mha", "ct.pbv"}) {
        ASSERT_TRUE(save_volume(file(name), head(1024), {}, "CT"));
        const ProgramRun info = run({"info", file(name).string()});
        EXPECT_EQ(info.exit_code, 0);
        EXPECT_THAT(info.messages, HasSubstr("taken as HU + 1024: bone at 300 HU is at 1324 here"))
            << name;
        ASSERT_TRUE(save_volume(file(name), head(0), {}, "CT"));
        EXPECT_THAT(run({"info", file(name).string()}).messages,
                    Not(HasSubstr("taken as HU + 1024: bone at 300 HU is at 1324 here")));
    }
}

// Commands keep a CT a CT, in formats with a place for it; a label map made of it is none.
TEST_F(DefaultPicture, AVolumeThatIsWrittenKeepsItsModality) {
    ASSERT_TRUE(save_volume(file("ct.nrrd"),
                            make_volume(make_grid(glm::uvec3(16), glm::dvec3(2.0)), ScalarType::i16,
                                        [](glm::uvec3 i) { return i.x < 8 ? -1000.0 : 700.0; }),
                            {}, "CT"));
    const std::string ct = file("ct.nrrd").string();
    const auto modality = [&](const std::string& name) {
        const std::string text = run({"info", "--json", file(name).string()}).output;
        return nlohmann::json::parse(text).value("modality", "");
    };
    EXPECT_EQ(modality("ct.nrrd"), "CT");
    ASSERT_EQ(run({"edit", ct, "--write-strokes", file("s.jsonl").string()}).exit_code, 0);
    ASSERT_EQ(run({"touch", ct, "--write-path", file("p.csv").string()}).exit_code, 0);
    for (const char* out : {"o.nrrd", "o.mha", "o.mhd", "o.pbv"}) {
        const std::string path = file(out).string();
        for (const std::vector<std::string>& words :
             {std::vector<std::string>{"convert", ct, path},
              {"filter", ct, "--gaussian", "2", "-o", path},
              {"filter", ct, "--type", "f32", "-o", path},
              {"edit", ct, file("s.jsonl").string(), "-o", path},
              {"touch", ct, "--path", file("p.csv").string(), "--drill", "3", "-o", path}}) {
            const ProgramRun ran = run(words);
            ASSERT_EQ(ran.exit_code, 0) << ran.messages;
            EXPECT_EQ(modality(out), "CT") << words[0] << " " << out;
        }
        ASSERT_EQ(run({"filter", ct, "--threshold", "300", "-o", path}).exit_code, 0);
        EXPECT_EQ(modality(out), "") << out;
    }
    // A modality that would break a header's line is left out.
    ASSERT_TRUE(save_volume(file("odd.nrrd"),
                            make_volume(make_grid(glm::uvec3(4), glm::dvec3(2.0)), ScalarType::u8,
                                        [](glm::uvec3 i) { return double(i.x); }),
                            {}, "CT\nencoding: hex"));
    EXPECT_EQ(modality("odd.nrrd"), "");
}

TEST_F(DefaultPicture, ALabelMapIsDrawnAsTheSurfacesOfItsLabels) {
    const auto labels = [](glm::dvec3 at) {
        return glm::length(at - 19.5) > 15 ? 0.0 : at.x < 20 ? 3.0 : 7.0;
    };
    const std::string volume =
        write_volume("labels.nrrd", glm::uvec3(40), cubic(2), labels, "uint16");
    const std::string scene = file("scene.json").string();
    const Picture picture = draw({volume, "--write-scene", scene});
    EXPECT_THAT(picture.messages, HasSubstr("a label map, by its values"));
    const auto hue = [](glm::dvec3 c) {
        return std::max({c.x, c.y, c.z}) - std::min({c.x, c.y, c.z});
    };
    EXPECT_GT(picture.share([&](glm::dvec3 c) { return hue(c) > 0.2; }), 0.1);
    EXPECT_EQ(rmse(draw({scene}), picture), 0.0) << "the scene that was written draws the same";
    EXPECT_THAT(draw({volume, "--mode", "mip"}).messages, Not(HasSubstr("label map")));
}

TEST_F(DefaultPicture, GreyValuesAreNoLabels) {
    const auto grey = [](glm::dvec3 at) {
        return std::max(0.0, 200.0 - 10.0 * glm::length(at - 19.5));
    };
    const Picture picture =
        draw({write_volume("grey.nrrd", glm::uvec3(40), cubic(2), grey, "uint16")});
    EXPECT_THAT(picture.messages, Not(HasSubstr("label map")));
    EXPECT_GT(picture.share(seen), 0.05);
}

} // namespace
} // namespace palpate
