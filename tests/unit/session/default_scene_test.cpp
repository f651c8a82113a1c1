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

} // namespace
} // namespace palpate
