#include "engine/session/default_scene.h"

#include <gtest/gtest.h>

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
