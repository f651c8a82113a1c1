#include "engine/session/default_scene.h"

#include <gtest/gtest.h>

#include <functional>

#include "engine/session/feel.h"
#include "engine/volume/builder.h"

namespace palpate {
namespace {

// A head of tissue in a shell of bone, in air: HU + offset.
LoadedScene head(const std::string& modality, double offset) {
    const auto value = [&](glm::uvec3 i) {
        const double r = glm::length(glm::dvec3(i) - 15.5);
        return offset + (r > 15.0 ? -1000.0 : r > 13.0 ? 900.0 : 40.0);
    };
    return {{make_volume(make_grid(glm::uvec3(32), glm::dvec3(1.0)), ScalarType::i16, value),
             std::nullopt,
             {}},
            modality,
            {},
            {},
            {},
            {}};
}

TEST(DefaultScene, ACtHasItsUnitWhereItsValuesAreHounsfieldUnits) {
    const LoadedScene ct = head("CT", 0.0);
    EXPECT_EQ(zero_hu(ct), 0.0);
    EXPECT_EQ(value_unit(ct), "HU");
    EXPECT_EQ(default_iso(ct), 300.0);
    EXPECT_EQ(default_ray_cast(RayMode::iso, ct).isos.front().value, 300.0);
}

TEST(DefaultScene, ACtWithoutItsOffsetHasNoUnitAndEyeAndHandTakeTheSameBone) {
    const LoadedScene ct = head("CT", 1024.0);
    EXPECT_EQ(zero_hu(ct), 1024.0);
    EXPECT_EQ(value_unit(ct), "");
    EXPECT_EQ(default_iso(ct), 1324.0);
    EXPECT_EQ(default_ray_cast(RayMode::iso, ct).isos.front().value, 1324.0);
}

using Value = std::function<double(glm::uvec3)>;

LoadedScene unnamed(const Value& value, ScalarType type = ScalarType::i16) {
    return {
        {make_volume(make_grid(glm::uvec3(40), glm::dvec3(1.0)), type, value), std::nullopt, {}},
        "",
        {},
        {},
        {},
        {}};
}

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

// A trunk in HU: fat about muscle, two lungs, a spine, and air around. `from` is its crop's corner,
// in shares of the trunk; `side` its length.
struct Trunk {
    glm::dvec3 from{0.0};
    double side = 1.0, sd = 0.0, offset = 0.0, padding = -1000.0;
    double operator()(glm::uvec3 at) const {
        const glm::dvec3 p = 2.0 * (from + side * glm::dvec3(at) / 39.0) - 1.0; // -1 .. 1
        const auto in = [&](glm::dvec2 middle, glm::dvec2 radii) {
            const glm::dvec2 q = (glm::dvec2(p) - middle) / radii;
            return glm::dot(q, q) <= 1.0;
        };
        if (!in({0, 0}, {1.0, 1.0}))
            return padding + offset;
        const bool lung = in({-0.4, -0.1}, {0.25, 0.35}) || in({0.4, -0.1}, {0.25, 0.35});
        const double hu = !in({0, 0}, {0.9, 0.8})      ? -1000.0
                          : in({0, 0.5}, {0.12, 0.15}) ? (in({0, 0.5}, {0.08, 0.1}) ? 250.0 : 800.0)
                          : lung                       ? -850.0
                          : in({0, 0}, {0.8, 0.7})     ? 50.0
                                                       : -100.0;
        return std::max(-1024.0, hu + sd * normal(at, 1)) + offset;
    }
};

TEST(DefaultScene, AnUnnamedCtBeginsWithBoneForEyeAndHand) {
    const Trunk trunks[] = {
        {},
        {.sd = 20.0},
        {.sd = 60.0},
        {.padding = -2000.0},
        {.sd = 30.0, .offset = 20.0}, // a scanner that is not calibrated well
        {.sd = 30.0, .offset = -20.0},
        {.from = {0.0, 0.0, 0.0}, .side = 0.5, .sd = 20.0}, // crops with air, lungs or both
        {.from = {0.5, 0.2, 0.0}, .side = 0.4, .sd = 20.0},
        {.from = {0.15, 0.3, 0.2}, .side = 0.7, .sd = 20.0},
    };
    for (const Trunk& trunk : trunks) {
        SCOPED_TRACE(testing::PrintToString(&trunk - trunks));
        const LoadedScene ct = unnamed(trunk);
        EXPECT_EQ(default_iso(ct), 300.0);
        EXPECT_EQ(default_ray_cast(RayMode::iso, ct).isos.front().value, 300.0);
        EXPECT_EQ(bone_value(ct), 300.0);
        EXPECT_EQ(skin_value(ct), -300.0);
        EXPECT_EQ(value_unit(ct), "") << "the values are not known to be HU";
    }
}

TEST(DefaultScene, OffsetsAndCropsWithoutAirAreNotTakenForHounsfieldUnits) {
    for (const Trunk& trunk :
         {Trunk{.offset = 1024.0}, Trunk{.offset = 1000.0}, Trunk{.offset = 400.0},
          Trunk{.offset = -400.0}, Trunk{.offset = 32768.0}, // unsigned
          Trunk{.from = {0.4, 0.6, 0.3}, .side = 0.2}}) {
        SCOPED_TRACE(trunk.offset);
        const LoadedScene found = unnamed(trunk, ScalarType::f32);
        EXPECT_FALSE(bone_value(found));
        EXPECT_FALSE(skin_value(found));
        const ValueRange range = found.data.volume.range();
        for (const double iso :
             {default_iso(found), default_ray_cast(RayMode::iso, found).isos.front().value}) {
            EXPECT_GT(iso, range.min);
            EXPECT_LT(iso, range.max);
        }
    }
}

TEST(DefaultScene, MrAndOtherSignedValuesAreNotTakenForACt) {
    const auto in_head = [](glm::uvec3 at) { return glm::length(glm::dvec3(at) - 19.5) < 16.0; };
    const auto tissue = [](glm::uvec3 at) { // grey and white matter, and fluid
        const double r = glm::length(glm::dvec3(at) - 19.5);
        return r > 14.0 ? 500.0 : r > 8.0 ? 900.0 : 1200.0;
    };
    const std::pair<const char*, Value> looks_alike[] = {
        {"magnitude",
         [&](glm::uvec3 at) {
             const double value = (in_head(at) ? tissue(at) : 0.0) + 40.0 * normal(at, 1);
             return std::hypot(value, 40.0 * normal(at, 2));
         }},
        {"magnitude with a fill of -1000",
         [&](glm::uvec3 at) { return in_head(at) ? tissue(at) + 50.0 * normal(at, 1) : -1000.0; }},
        {"phase", [](glm::uvec3 at) { return 8192.0 * noise(at, 3) - 4096.0; }},
        {"phase in a head",
         [&](glm::uvec3 at) { return in_head(at) ? 4096.0 * noise(at, 3) - 2048.0 : -1000.0; }},
        {"a difference of two pictures", [](glm::uvec3 at) { return 400.0 * normal(at, 4); }},
        {"thousandths of a standard deviation",
         [&](glm::uvec3 at) {
             return in_head(at) ? 1.6 * (tissue(at) - 600.0) + 150.0 * normal(at, 5)
                                : -900.0 + 20.0 * normal(at, 6);
         }},
        {"a magnitude moved by -1000",
         [&](glm::uvec3 at) {
             return (in_head(at) ? 2.0 * tissue(at) : 0.0) - 1000.0 + 50.0 * noise(at, 7);
         }},
        {"flow along and against", [&](glm::uvec3 at) {
             const double x = (at.x - 19.5) / 20.0;
             return in_head(at) ? 1500.0 * x + 40.0 * normal(at, 8) : 0.0;
         }}};
    for (const auto& [name, value] : looks_alike) {
        SCOPED_TRACE(name);
        EXPECT_FALSE(bone_value(unnamed(value)));
    }
    LoadedScene named = unnamed(Trunk{});
    named.modality = "MR"; // what the file states is believed
    EXPECT_FALSE(bone_value(named));
}

TEST(DefaultScene, OtherModalitiesHaveNoUnit) {
    for (const char* modality : {"MR", ""})
        EXPECT_EQ(value_unit(head(modality, 1024.0)), "") << modality;
}

TEST(DefaultScene, SmallValuesThatAreMeantToBeBrightAreShownSo) {
    for (const char* modality : {"", "MR", "CT"}) {
        SCOPED_TRACE(modality);
        // Without a modality, values that cannot be Hounsfield units.
        const LoadedScene plain = head(modality, *modality == 'C' ? 0.0 : 5000.0);
        LoadedScene turned = plain;
        turned.inverted = true;
        const auto expect_mirrored = [](const TransferFunction& a, const TransferFunction& b) {
            const double low = a.colors.front().value, high = a.colors.back().value;
            EXPECT_EQ(b.colors.front().value, low);
            EXPECT_EQ(b.colors.back().value, high);
            for (const double share : {0.0, 0.2, 0.5, 0.9, 1.0}) {
                const double at = low + share * (high - low), other = high - share * (high - low);
                EXPECT_NEAR(glm::distance(color_at(a, at), color_at(b, other)), 0.0, 1e-9);
                EXPECT_NEAR(opacity_at(a, at), opacity_at(b, other), 1e-9);
            }
        };
        expect_mirrored(default_slice_transfer(plain), default_slice_transfer(turned));
        const TransferFunction mip = default_ray_cast(RayMode::mip, turned).transfer;
        EXPECT_EQ(mip.colors.front().color.x, 1.0);
        EXPECT_EQ(mip.colors.back().color.x, 0.0);
        EXPECT_GT(mip.opacities.front().opacity, mip.opacities.back().opacity);
        // A choice by Hounsfield units stands for matter, not for a shade of grey.
        const bool hu = *modality == 'C';
        const double iso = default_ray_cast(RayMode::iso, plain).isos.front().value;
        const double other = default_ray_cast(RayMode::iso, turned).isos.front().value;
        EXPECT_EQ(iso == other, hu);
        EXPECT_EQ(default_ray_cast(RayMode::alpha, plain).transfer ==
                      default_ray_cast(RayMode::alpha, turned).transfer,
                  hu);
    }
}

} // namespace
} // namespace palpate
