// Default pictures of 36 kinds of data: an object must stand out from what surrounds it, in slices
// and in rays of modes mip and alpha.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "engine/reference/twin.h"
#include "engine/scene/presets.h"
#include "engine/session/bright_background.h"
#include "engine/session/default_scene.h"
#include "engine/volume/builder.h"

namespace palpate {
namespace {

using Value = std::function<double(glm::uvec3)>;
using Part = std::function<bool(glm::uvec3)>;

constexpr uint32_t kSide = 25;
constexpr glm::dvec3 kMiddle{14.0, 11.0, 12.0}; // of the object; in the plane of each slice's z

// Any number in 0 .. 1 that follows from the place and the seed alone.
double noise(glm::uvec3 at, uint32_t seed) {
    uint32_t h = at.x * 73856093u ^ at.y * 19349663u ^ at.z * 83492791u ^ seed * 2246822519u;
    h = (h ^ h >> 15) * 2654435761u;
    h = (h ^ h >> 13) * 3266489917u;
    return ((h ^ h >> 16) >> 8) * 0x1p-24;
}
// Noise of mean 0 and standard deviation 1 (Irwin and Hall's sum of 12).
double normal(glm::uvec3 at, uint32_t seed) {
    double sum = -6.0;
    for (uint32_t i = 0; i < 12; ++i)
        sum += noise(at, 12 * seed + i);
    return sum;
}
double cauchy(glm::uvec3 at, uint32_t seed) {
    return std::tan(M_PI * (noise(at, seed) - 0.5));
}
double radius(glm::uvec3 at) {
    return glm::length(glm::dvec3(at) - kMiddle);
}
Part ball(double r) {
    return [r](glm::uvec3 at) { return radius(at) <= r; };
}
bool one_sample(glm::uvec3 at) {
    return at == glm::uvec3(kMiddle);
}
// Few samples, apart from each other.
bool is_outlier(glm::uvec3 at) {
    return at.x % 8 == 3 && at.y % 8 == 2 && at.z % 8 == 4;
}
// `inside` a part, else `outside`.
Value two(const Part& part, double inside, double outside) {
    return [=](glm::uvec3 at) { return part(at) ? inside : outside; };
}
Value plus(const Value& value, double sd, uint32_t seed) {
    return [=](glm::uvec3 at) { return value(at) + sd * normal(at, seed); };
}

struct Kind {
    const char* name;
    ScalarType type;
    Value value;
    Part object = ball(6.0);
    const char* modality = "";
};
std::vector<Kind> kinds() {
    using enum ScalarType;
    const Value core = [](glm::uvec3 at) {
        return radius(at) <= 3.0 ? 300.0 : radius(at) <= 6.0 ? 600.0 : 3000.0;
    };
    const Value mr = [](glm::uvec3 at) { // air has the noise of a magnitude
        if (radius(at) <= 6.0)
            return 900.0 + 300.0 * std::sin(at.x) * std::cos(at.y) + 30.0 * normal(at, 3);
        return 40.0 * std::hypot(normal(at, 4), normal(at, 5));
    };
    const Value soft = [](glm::uvec3 at) { return 1.0 / (1.0 + std::exp(radius(at) - 6.0)); };
    const Value head = [](glm::uvec3 at) {
        return radius(at) <= 4.0 ? 40.0 : radius(at) <= 6.0 ? 900.0 : -1000.0;
    };
    const auto with_outliers = [](const Value& value, double outlier) {
        return [=](glm::uvec3 at) { return is_outlier(at) ? outlier : value(at); };
    };
    const auto turned = [](const Value& value, double from) {
        return [=](glm::uvec3 at) { return from - value(at); };
    };
    const auto in_circle = [](const Value& value, double outside) {
        return [=](glm::uvec3 at) {
            return glm::length(glm::dvec2(at) - 12.0) > 11.0 ? outside : value(at);
        };
    };
    return {
        {"bright background", i16, core},
        {"bright background with noise", i16, plus(core, 25.0, 1)},
        {"bright background with outliers above", f32, with_outliers(core, 1e6)},
        {"bright background with outliers below", f32, with_outliers(core, -1e6)},
        {"MR", i16, mr},
        {"inverted MR", i16, turned(mr, 4095.0)},
        {"probabilities", f32, soft},
        {"inverted probabilities", f32, turned(soft, 1.0)},
        {"probabilities of a softmax", f32,
         [=](glm::uvec3 at) { return soft(at) + 1e-4 * noise(at, 6); }},
        {"two values", f32, two(ball(6.0), 1.0, 0.0)},
        {"two values, inverted", f32, two(ball(6.0), 0.0, 1.0)},
        {"two values of a byte, inverted", u8, two(ball(6.0), 0.0, 255.0)},
        {"one outlier", f32,
         [=](glm::uvec3 at) { return at == glm::uvec3(3, 2, 4) ? 1e6 : mr(at); }},
        {"a few outliers", f32, with_outliers(mr, 1e6)},
        {"a few outliers beside a constant background", f32,
         with_outliers(two(ball(6.0), 100.0, 0.0), 1e6)},
        {"outliers far below", f32, with_outliers(mr, -1e6)},
        {"huge offset", f32, [=](glm::uvec3 at) { return 1e6 + 100.0 * soft(at); }},
        {"huge negative offset", f32, [=](glm::uvec3 at) { return -1e6 + 100.0 * soft(at); }},
        {"huge scale", f32, [=](glm::uvec3 at) { return 1e28 * soft(at); }},
        {"tiny scale", f32, [=](glm::uvec3 at) { return 1e-12 * soft(at); }},
        {"negative only", i16, two(ball(6.0), -300.0, -500.0)},
        {"negative only, bright background", i16, two(ball(6.0), -500.0, -300.0)},
        {"sparse mask", f32, two(ball(1.8), 1.0, 0.0), ball(1.8)},
        {"one sample", f32, two(one_sample, 1.0, 0.0), one_sample},
        {"one dark sample", f32, two(one_sample, 0.0, 1.0), one_sample},
        {"no data outside", f32, in_circle(mr, NAN)},
        {"infinities outside", f32, in_circle(two(ball(6.0), 2.0, 1.0), INFINITY)},
        {"heavy tails", f32,
         [](glm::uvec3 at) { return (radius(at) <= 6.0 ? 100.0 : 0.0) + 0.5 * cauchy(at, 7); }},
        {"hot spot", f32,
         [](glm::uvec3 at) { return std::exp(normal(at, 8)) * (radius(at) <= 3.0 ? 40.0 : 1.0); },
         ball(3.0)},
        {"object larger than its surroundings", u16, two(ball(10.9), 257.0, 0.0), ball(10.9)},
        {"saturated object in noise", u16,
         [](glm::uvec3 at) { return radius(at) <= 10.9 ? 4095.0 : std::abs(50.0 * normal(at, 9)); },
         ball(10.9)},
        {"CT", i16, head, ball(6.0), "CT"},
        {"CT with a bright background", i16, two(ball(6.0), 40.0, 3071.0), ball(6.0), "CT"},
        {"CT without bone", i16, plus(two(ball(6.0), 30.0, -1000.0), 10.0, 10), ball(6.0), "CT"},
        {"CT that holds shares", f32, soft, ball(6.0), "CT"},
        {"CT of bone alone", i16, two(ball(6.0), 1500.0, 400.0), ball(6.0), "CT"},
        {"CT of lung alone", i16, two(ball(6.0), -600.0, -900.0), ball(6.0), "CT"},
    };
}

Volume made(ScalarType type, const Value& value) {
    return make_volume(make_grid(glm::uvec3(kSide), {1.0, 1.0, 1.0}), type, value);
}

// A scene's greys, 0 .. 1, as eight bits hold them.
std::vector<double> greys(const Scene& scene, const Volume& volume) {
    const Image picture = render_twin(scene, {volume, std::nullopt, {}});
    std::vector<double> out;
    for (uint32_t y = 0; y < picture.size_px.y; ++y)
        for (uint32_t x = 0; x < picture.size_px.x; ++x) {
            double sum = 0.0;
            for (size_t c = 0; c < 3; ++c)
                sum += std::round(255.0 * std::clamp(double{picture.at(x, y, c)}, 0.0, 1.0));
            out.push_back(sum / 3.0);
        }
    return out;
}

// The same camera on a volume of 1 in a part and 0 elsewhere: which pixels show the part.
std::vector<double> shown_part(Scene scene, const Part& part) {
    if (scene.ray_cast) {
        scene.ray_cast = RayCastLayer{};
        scene.ray_cast->mode = RayMode::mip;
        scene.ray_cast->integrator = Integrator::exact;
        scene.ray_cast->transfer = window_function(0.0, 1.0, 1.0);
    }
    scene.slice_transfer = window_function(0.0, 1.0, 1.0);
    return greys(scene, made(ScalarType::f32, two(part, 1.0, 0.0)));
}

struct Contrast {
    double object = 0.0, around = 0.0, sd_around = 0.0; // 0 .. 255
};

// Compares pixels whose ray meets the object with those whose ray meets the volume but nothing of
// the object.
Contrast contrast_of(const Scene& scene, const Kind& kind) {
    const std::vector<double> grey = greys(scene, made(kind.type, kind.value));
    const std::vector<double> object = shown_part(scene, kind.object);
    const std::vector<double> box = shown_part(scene, [](glm::uvec3) { return true; });
    double objects = 0.0, others = 0.0, squares = 0.0;
    Contrast out;
    for (size_t i = 0; i < grey.size(); ++i)
        if (object[i] > 128.0) {
            out.object += grey[i];
            ++objects;
        } else if (object[i] == 0.0 && box[i] > 0.0) {
            out.around += grey[i];
            squares += grey[i] * grey[i];
            ++others;
        }
    EXPECT_GT(objects, 0.0) << kind.name;
    EXPECT_GT(others, 0.0) << kind.name;
    out.object /= objects;
    out.around /= others;
    out.sd_around = std::sqrt(std::max(0.0, squares / others - out.around * out.around));
    return out;
}

LoadedScene loaded(const Kind& kind) {
    return {{made(kind.type, kind.value), std::nullopt, {}}, kind.modality, {}, {}, {}, {}};
}

// An eighth of the greys apart on the mean, and no less than the surroundings vary.
void expect_seen(Scene scene, const Kind& kind, const LoadedScene& of) {
    scene.size_px = {28, 28};
    scene.camera = default_camera(scene, of.data);
    const Contrast found = contrast_of(scene, kind);
    const double apart = std::abs(found.object - found.around);
    EXPECT_GE(apart, 32.0) << kind.name << ": " << found.object << " in " << found.around;
    EXPECT_GE(apart, found.sd_around)
        << kind.name << ": " << found.object << " in " << found.around;
}

TEST(DefaultPictures, SlicesShowAnObjectInAnyData) {
    for (const Kind& kind : kinds()) {
        const LoadedScene of = loaded(kind);
        Scene scene;
        scene.slices = {SliceLayer{center_mm(of.data.volume.grid()), {0, 0, 1}}};
        scene.slice_transfer = default_slice_transfer(of);
        expect_seen(scene, kind, of);
    }
}

TEST(DefaultPictures, MipsShowAnObjectInAnyData) {
    for (const Kind& kind : kinds()) {
        const LoadedScene of = loaded(kind);
        Scene scene;
        scene.ray_cast = default_ray_cast(RayMode::mip, of);
        expect_seen(scene, kind, of);
    }
}

TEST(DefaultPictures, AlphaShowsAnObjectInAnyData) {
    for (const Kind& kind : kinds()) {
        const LoadedScene of = loaded(kind);
        Scene scene;
        scene.ray_cast = default_ray_cast(RayMode::alpha, of);
        scene.ray_cast->step_mm = 1.0;
        expect_seen(scene, kind, of);
    }
}

TEST(DefaultPictures, ABrightBackgroundIsSaidAndADarkOneIsNot) {
    for (const Kind& kind : kinds()) {
        const std::string name = kind.name, told = told_of_bright_background(loaded(kind));
        const bool is_bright = name.find("bright background") != name.npos ||
                               name.find("inverted") != name.npos || name == "one dark sample";
        EXPECT_EQ(!told.empty(), is_bright) << name << ": " << told;
    }
}

// An ordinary CT and MR look as they always did.
TEST(DefaultPictures, OrdinaryDataHaveTheirUsualWindows) {
    const std::vector<Kind> all = kinds();
    const auto named = [&](const char* name) {
        return loaded(*std::find_if(all.begin(), all.end(), [&](const Kind& kind) {
            return std::string(kind.name) == name;
        }));
    };
    EXPECT_EQ(default_slice_transfer(named("CT")), window_function(-160.0, 240.0, 1.0));
    EXPECT_EQ(default_ray_cast(RayMode::mip, named("CT")).transfer,
              window_function(-200.0, 900.0, 1.0));
    TransferFunction bone = *preset("ct-bone");
    bone.opacity_unit_mm = preset_unit_mm(named("CT").data.volume.grid());
    EXPECT_EQ(default_ray_cast(RayMode::alpha, named("CT")).transfer, bone);
    const TransferFunction mr = default_slice_transfer(named("MR"));
    EXPECT_LT(mr.colors.front().value, 50.0);
    EXPECT_GT(mr.colors.back().value, 1000.0);
    EXPECT_FALSE(default_ray_cast(RayMode::mip, named("MR")).transfer.opacities.front().opacity >
                 0.0);
}

} // namespace
} // namespace palpate
