// R11 .. R13: what samplers and storage formats make of a value.

#include <cmath>
#include <set>

#include "bench/cases/scenes.h"
#include "engine/volume/builder.h"

namespace palpate::cases {

namespace {

struct Format {
    const char* name;
    TexelFormat format;
    double rounding; // of a value, in code steps of a 16-bit type
};

// fp32 keeps every code; a normalised format rounds once on either way, 2^-23 of 65536 codes.
constexpr Format kFormats[] = {{"as chosen", TexelFormat::automatic, 65536.0 * 0x1p-23},
                               {"R16", TexelFormat::unorm16, 65536.0 * 0x1p-23},
                               {"R32F", TexelFormat::f32, 65536.0 * 0x1p-23}};

} // namespace

void filter_weights(Painter& painter, Findings& findings) {
    const uint32_t places = 1024;
    for (const ScalarType type : {ScalarType::f32, ScalarType::u16})
        for (const Format& format : kFormats) {
            if (type == ScalarType::f32 && format.format == TexelFormat::unorm16)
                continue;
            const double high = type == ScalarType::f32 ? 1.0 : 65535.0;
            const SceneData data{make_volume(make_grid({2, 2, 2}, {1, 1, 1}), type,
                                             [=](glm::uvec3 i) { return i.x * high; }),
                                 {}};
            // Pixel k looks at x = (k + 0.5) / 1024, exactly.
            Scene scene = parallel({0, 0, 1}, {0.5, 0.5, 0.5}, 1.0 / places, {places, 1});
            scene.ray_cast->mode = RayMode::mip;
            scene.ray_cast->transfer = window_function(0.0, high, 1.0);
            scene.value_and_depth = true;
            const Image image = painter.draw(scene, data, {.volume_format = format.format});
            findings.part("share of the step between two texels that a value is off");
            findings.in(fmt::format("{} stored {}", palpate::name_of(type), format.name));
            std::set<float> distinct;
            const View view = make_view(scene.camera, scene.size_px);
            for (uint32_t x = 0; x < places; ++x) {
                findings.at(x, 0);
                const double at = ray_through(view, {x, 0}, scene.size_px).origin_mm.x;
                // fp32 texture coordinates up to 2: a few of 2^-23.
                findings.near(image.at(x, 0, 4) / high, at, painter.weight_rounding() + 0x1p-20);
                distinct.insert(image.at(x, 0, 4));
            }
            findings.at(0, 0);
            findings.part("values missing between two texels");
            const double expected = painter.weight_rounding() == 0.0
                                        ? places
                                        : std::min<double>(places, 0.5 / painter.weight_rounding());
            findings.within(std::max(0.0, expected - static_cast<double>(distinct.size())), 0.0);
        }
}

void storage_format(Painter& painter, Findings& findings) {
    for (const ScalarType type : {ScalarType::u16, ScalarType::i16})
        for (const Format& format : kFormats) {
            const double low = type == ScalarType::u16 ? 0.0 : -32768.0;
            const SceneData data{make_volume(make_grid({256, 256, 2}, {1, 1, 1}), type,
                                             [=](glm::uvec3 i) { return low + i.x + 256.0 * i.y; }),
                                 {}};
            Scene scene = parallel({0, 0, 1}, {127.5, 127.5, 0.5}, 1.0, {256, 256});
            scene.ray_cast->mode = RayMode::mip;
            scene.ray_cast->transfer = window_function(low, low + 65535.0, 1.0);
            scene.value_and_depth = true;
            const Image image = painter.draw(scene, data, {.volume_format = format.format});
            findings.part("codes off, all 65536 of u16 and i16");
            findings.in(fmt::format("{} stored {}", palpate::name_of(type), format.name));
            for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray& ray) {
                // Beside a texel's centre by 2^-23 of 256 texels, whose neighbours are 257 away.
                const double code =
                    low + std::round(ray.origin_mm.x) + 256.0 * std::round(ray.origin_mm.y);
                findings.near(image.at(x, y, 4), code, format.rounding + 257.0 * 256.0 * 0x1p-23);
            });
        }

    // A surface at every integer of 12-bit CT. Row r, three samples thick, rises from 64 r - 1025
    // to 64 r - 960 in 65 samples of 1 mm, so that of surfaces 512 apart it meets one at most,
    // between its first and its last sample.
    const SceneData data{make_volume(make_grid({66, 192, 2}, {1, 1, 1}), ScalarType::i16,
                                     [](glm::uvec3 i) { return 64.0 * (i.y / 3) - 1025.0 + i.x; }),
                         {}};
    for (const Format& format : kFormats) {
        findings.part("mm that a surface at an integer of 12-bit CT is off");
        for (int first = -1024; first < -512; ++first) {
            Scene scene = parallel({1, 0, 0}, {32.0, 95.5, 0.5}, 3.0, {64, 1}); // a pixel a row
            scene.camera.eye_mm.x = -16.0;
            scene.ray_cast->mode = RayMode::iso;
            scene.ray_cast->step_mm = 1.0;
            scene.value_and_depth = true;
            for (int i = 0; i < 8; ++i)
                scene.ray_cast->isos.push_back({first + 512.0 * i});
            findings.in(fmt::format("surfaces at {} + 512 k stored {}", first, format.name));
            const Image image = painter.draw(scene, data, {.volume_format = format.format});
            for_each_pixel(scene, findings, [&](uint32_t x, uint32_t y, const Ray& ray) {
                const double row = std::floor(std::round(ray.origin_mm.y) / 3.0);
                const double below = first - (64.0 * row - 1025.0);
                const double place = below - 512.0 * std::floor(below / 512.0);
                if (place == 0.0 || place == 65.0) // at the end of the row: met or not
                    return;
                findings.expect((image.at(x, y, 3) == 1.0f) == (place < 65.0),
                                "the row that holds the value, and no other, to show the surface");
                // Texels at either end of the bracket and the iso-value are rounded; 1 code a mm.
                if (place < 65.0)
                    findings.near(image.at(x, y, 5), 16.0 + place,
                                  4.0 * format.rounding + kPlaceMm + painter.weight_rounding());
            });
        }
    }
}

void range_scaling(Painter& painter, Findings& findings) {
    const struct {
        ScalarType type;
        double first, step;
    } ramps[] = {{ScalarType::u8, 0, 1},          {ScalarType::i8, -128, 1},
                 {ScalarType::u16, 0, 257},       {ScalarType::u16, 3840, 1},
                 {ScalarType::i16, -32768, 257},  {ScalarType::i16, -1024, 16},
                 {ScalarType::f32, -1000.5, 0.25}};
    for (const auto& ramp : ramps) {
        Scene scene = parallel({0, 0, 1}, {127.5, 0.5, 0.5}, 1.0, {256, 1});
        scene.ray_cast->mode = RayMode::mip;
        scene.ray_cast->transfer = window_function(ramp.first, ramp.first + 255 * ramp.step, 1.0);
        scene.value_and_depth = true;
        const SceneData data{
            make_volume(make_grid({256, 2, 2}, {1, 1, 1}), ramp.type,
                        [=](glm::uvec3 i) { return ramp.first + ramp.step * i.x; }),
            {}};
        for (const Format& format : kFormats) {
            if (ramp.type == ScalarType::f32 && format.format == TexelFormat::unorm16)
                continue;
            findings.in(fmt::format("{} from {} by {}, stored {}", palpate::name_of(ramp.type),
                                    ramp.first, ramp.step, format.name));
            const Image image = painter.draw(scene, data, {.volume_format = format.format});
            for (uint32_t x = 0; x < 256; ++x) {
                findings.at(x, 0);
                findings.part("codes off");
                const double code = ramp.first + ramp.step * x;
                findings.near(image.at(x, 0, 4), code, 65536.0 * 0x1p-23);
                findings.part("grey of each code");
                findings.near(image.at(x, 0, 0), x / 255.0 * image.at(x, 0, 3), 0.5 / 4095 + 1e-6);
            }
            findings.at(0, 0);
        }
    }
}

} // namespace palpate::cases
