// The table of the settings of touch: what is made from it, and that it is whole.

#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "engine/session/touch_json.h"
#include "haptics/field/coupling.h"
#include "haptics/servo/parameter_slew.h"
#include "tests/support/table_rows.h"

namespace palpate {
namespace {

using namespace haptics;

TouchParameters read(const std::string& text, std::string& error) {
    const Json json = parse_json(text, "f").value();
    JsonErrors errors{"f", {}};
    const TouchParameters parameters = read_touch_parameters(JsonValue(json, "touch", errors));
    error = errors.first ? errors.first->message : "";
    return parameters;
}

// Numbers fill the struct between its other members, so a number without a row leaves a gap.
TEST(TouchSettings, EveryNumberOfTheParametersHasARow) {
    const TouchParameters p;
    const auto* base = reinterpret_cast<const std::byte*>(&p);
    std::set<size_t> doubles;
    for (const Setting<TouchParameters>& setting : kTouchSettings)
        if (const auto* member = std::get_if<double TouchParameters::*>(&setting.member))
            doubles.insert(
                static_cast<size_t>(reinterpret_cast<const std::byte*>(&(p.**member)) - base));
    const auto between = [&](const void* from, const void* to) {
        for (const auto* at = static_cast<const std::byte*>(from); at < to; at += sizeof(double))
            EXPECT_TRUE(doubles.contains(static_cast<size_t>(at - base))) << "byte " << at - base;
    };
    between(&p.stiffness_n_per_m, &p.source);
    between(&p.normal_blur_samples, &p.transfer);
    between(&p.surface_delay_s, &p.label_count);
}

TEST(TouchSettings, ReachTheFileAndComeBackFromBothEndsOfTheirRanges) {
    for (const Setting<TouchParameters>& setting : kTouchSettings)
        for (const double value : {setting.least, setting.most, 0.5 * setting.most}) {
            if (!allows(setting, value))
                continue;
            TouchParameters p;
            set(setting, p, value);
            std::string error;
            const TouchParameters again = read(json_text(touch_parameters_json(p)), error);
            EXPECT_EQ(error, "") << setting.key;
            EXPECT_EQ(value_of(setting, again), value) << setting.key;
        }
}

TEST(TouchSettings, BeyondTheirRangesOneSentenceNamesKeyRangeUnitAndWhatWasFound) {
    std::string error;
    read(R"({"stiffness_n_per_m": -1})", error);
    EXPECT_EQ(error,
              "f:1: touch.stiffness_n_per_m: expected a number from 0 to 1000000 N/m, found -1");
    read(R"({"tool_samples": 1.5})", error);
    EXPECT_EQ(error, "f:1: touch.tool_samples: expected a whole number from 1 to 4096, found 1.5");
    read(R"({"stifness_n_per_m": 1})", error);
    EXPECT_THAT(error, testing::HasSubstr("did you mean \"stiffness_n_per_m\"?"));
    for (const Setting<TouchParameters>& setting : kTouchSettings) {
        if (is_whole(setting))
            continue;
        for (const double value : {std::nextafter(setting.least, -INFINITY),
                                   std::nextafter(setting.most, INFINITY), std::nan("")}) {
            TouchParameters p;
            EXPECT_TRUE(is_sane(p));
            set(setting, p, value);
            EXPECT_FALSE(is_sane(p)) << setting.key << " " << value;
        }
    }
}

// In 20 ms, half of it after 10; what is not slewed is there at once.
TEST(TouchSettings, AreSlewedAsTheirRowsSay) {
    for (const Setting<TouchParameters>& setting : kTouchSettings) {
        ParameterSlew slew;
        TouchParameters p;
        set(setting, p, 1.0);
        slew.step(p, 1e-3);
        set(setting, p, 3.0);
        double now = 0.0;
        for (int ms = 0; ms < 10; ++ms)
            now = value_of(setting, slew.step(p, 1e-3));
        EXPECT_NEAR(now, setting.use.slew == Slew::none ? 3.0 : 2.0, 1e-9) << setting.key;
    }
}

TEST(TouchSettings, AreTheTableOfTheReferencePage) {
    const std::string heading = "| key | option | range | by itself | read by | what it does |";
    std::vector<std::string> expected;
    const TouchParameters usual;
    for (const Setting<TouchParameters>& setting : kTouchSettings) {
        const SettingUse& use = setting.use;
        const std::string readers = use.of ? takers_text(use.of) : "";
        expected.push_back(fmt::format(
            "| `{}` |{} | {} to {}{} | {} | {} | {} |", setting.key,
            *use.option ? fmt::format(" `--{}`", use.option) : "", setting.least, setting.most,
            *setting.unit ? fmt::format(" {}", setting.unit) : "",
            *use.by_default ? use.by_default : fmt::format("{}", value_of(setting, usual)),
            readers.empty() ? "all" : fmt::format("`{}`", readers), setting.help));
    }
    EXPECT_EQ(table_rows("docs/reference/touch.md", heading), expected)
        << "the table of docs/reference/touch.md should be\n"
        << heading << "\n"
        << fmt::format("{}", fmt::join(expected, "\n"));
}

} // namespace
} // namespace palpate
