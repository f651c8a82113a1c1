// The tables of the numbers of a scene: what is made from them.

#include "engine/scene/scene_settings.h"

#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/scene/scene_file.h"
#include "tests/support/table_rows.h"

namespace palpate {
namespace {

// A scene file of one layer in which a key has a value. `object` is the place of the key: the top,
// or under "ray_cast" and so on.
std::string with_key(const std::string& object, const std::string& key, double value) {
    const std::string pair = fmt::format("\"{}\": {}", key, value);
    if (object.empty())
        return fmt::format(R"({{"volume": "v", "surfaces": [{{"iso": 1}}], {}}})", pair);
    if (object == "ray_cast")
        return fmt::format(R"({{"volume": "v", "ray_cast": {{"transfer": "mr", {}}}}})", pair);
    if (object == "slices[]")
        return fmt::format(
            R"({{"volume": "v", "slice_transfer": "mr", "slices": [{{"normal": [0, 0, 1], {}}}]}})",
            pair);
    return fmt::format(R"({{"volume": "v", "ray_cast": {{"transfer": "mr", "{}": {{{}}}}}}})",
                       object.substr(object.find('.') + 1), pair);
}

// Calls `check(object, table, read)` for every table whose struct a scene holds at one place;
// read(scene) is that struct.
template <class Check>
void for_each_table(const Check& check) {
    const auto of = [&]<class Struct>(const char* object, std::span<const Setting<Struct>> settings,
                                      const auto& part) { check(object, settings, part); };
    of.template operator()<Scene>("", kSceneSettings,
                                  [](const Scene& s) -> const Scene& { return s; });
    of.template operator()<RayCastLayer>(
        "ray_cast", kRayCastSettings,
        [](const Scene& s) -> const RayCastLayer& { return *s.ray_cast; });
    of.template operator()<Shading>(
        "ray_cast.shading", kShadingSettings,
        [](const Scene& s) -> const Shading& { return *s.ray_cast->shading; });
    of.template operator()<Light>(
        "ray_cast.light", kLightSettings,
        [](const Scene& s) -> const Light& { return *s.ray_cast->light; });
    of.template operator()<SliceLayer>(
        "slices[]", kSliceSettings,
        [](const Scene& s) -> const SliceLayer& { return s.slices.at(0); });
}

TEST(SceneSettings, ReachTheFileAndComeBackFromBothEndsOfTheirRanges) {
    for_each_table([](const std::string& object, auto settings, const auto& part) {
        for (const auto& setting : settings)
            for (const double value : {setting.least, setting.most}) {
                const auto read = parse_scene(with_key(object, setting.key, value), "f");
                ASSERT_TRUE(read) << read.error().message;
                EXPECT_EQ(value_of(setting, part(read->scene)), value) << setting.key;
                const auto again = parse_scene(write_scene(*read), "f");
                ASSERT_TRUE(again) << again.error().message;
                EXPECT_EQ(value_of(setting, part(again->scene)), value) << setting.key;
            }
    });
}

TEST(SceneSettings, BeyondTheirRangesTheMessageNamesTheKeyAndTheRange) {
    for_each_table([](const std::string& object, auto settings, const auto&) {
        for (const auto& setting : settings)
            for (const double value : {setting.least - 1.0, setting.most + 1.0}) {
                const auto read = parse_scene(with_key(object, setting.key, value), "f");
                ASSERT_FALSE(read) << setting.key << " " << value;
                const std::string expected =
                    fmt::format("{}: expected {}, found", setting.key, range_text(setting));
                EXPECT_NE(read.error().message.find(expected), std::string::npos)
                    << read.error().message;
            }
    });
}

// A scene from before ambient occlusion has no key for it, and its hash must stay.
TEST(SceneSettings, TheTextOfASceneIsAsBeforeThereWasAmbientOcclusion) {
    const auto plain = parse_scene(with_key("ray_cast", "min_transmittance", 0.0), "f");
    ASSERT_TRUE(plain);
    const std::string text = write_scene(*plain);
    EXPECT_EQ(text.find("ambient_occlusion_mm"), std::string::npos);
    EXPECT_NE(text.find("min_transmittance"), std::string::npos);
}

template <class Struct>
void add_rows(std::vector<std::string>& rows, const char* object,
              std::span<const Setting<Struct>> settings) {
    const Struct usual{};
    for (const Setting<Struct>& setting : settings) {
        const SettingUse& use = setting.use;
        rows.push_back(fmt::format(
            "| {} | `{}` |{} | {} to {}{} | {} | {} |", object, setting.key,
            *use.option ? fmt::format(" `--{}`", use.option) : "", setting.least, setting.most,
            *setting.unit ? fmt::format(" {}", setting.unit) : "",
            *use.by_default ? use.by_default : fmt::format("{}", value_of(setting, usual)),
            setting.help));
    }
}

TEST(SceneSettings, AreTheTableOfTheReferencePage) {
    const std::string heading = "| in | key | option | range | by itself | what it does |";
    std::vector<std::string> expected;
    add_rows<RayCastLayer>(expected, "`ray_cast`", kRayCastSettings);
    add_rows<Shading>(expected, "`shading`", kShadingSettings);
    add_rows<Light>(expected, "`light`", kLightSettings);
    add_rows<SliceLayer>(expected, "`slices`", kSliceSettings);
    add_rows<LabelLayer>(expected, "`label_layer`, `overlay_layer`", kLabelLayerSettings);
    add_rows<FusionLayer>(expected, "`fusion_layer`", kFusionSettings);
    add_rows<SurfaceStyle>(expected, "`surfaces`, their `styles`", kSurfaceStyleSettings);
    add_rows<Scene>(expected, "the top", kSceneSettings);
    EXPECT_EQ(table_rows("docs/reference/scene.md", heading), expected)
        << "the table of docs/reference/scene.md should be\n"
        << heading << "\n|---|---|---|---|---|---|\n"
        << fmt::format("{}", fmt::join(expected, "\n"));
}

} // namespace
} // namespace palpate
