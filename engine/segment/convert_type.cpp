#include "engine/segment/convert_type.h"

#include <cmath>

#include "engine/volume/nearest_stored.h"

namespace palpate {

std::optional<ScalarType> scalar_type_named(std::string_view name) {
    for (const ScalarType type :
         {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16, ScalarType::f32})
        if (name == name_of(type))
            return type;
    return std::nullopt;
}

BrickMaker converted_bricks(const Volume& volume, ScalarType type) {
    return {volume.grid(), type, [volume, type](glm::uvec3 at) {
                const Brick& from = volume.brick(at);
                if (from.type() == type)
                    return volume.brick_ptr(at);
                return visit_scalar(type, [&](auto t) -> BrickPtr {
                    using T = decltype(t);
                    const auto nearest = [](float v) {
                        return std::isnan(v) && !std::is_floating_point_v<T>
                                   ? T{}
                                   : nearest_stored<T>(double{v});
                    };
                    if (from.is_constant())
                        return Brick::make(std::span<const T>(&(t = nearest(from.value(0))), 1));
                    thread_local std::vector<float> read(kBrickSamples);
                    thread_local std::vector<T> made(kBrickSamples);
                    from.read(std::span(read));
                    for (size_t i = 0; i < kBrickSamples; ++i)
                        made[i] = nearest(read[i]);
                    return Brick::make(std::span<const T>(made), volume.valid_in_brick(at));
                });
            }};
}

std::string what_type_loses(const Volume& volume, ScalarType type) {
    if (type == ScalarType::f32)
        return "";
    std::string text;
    visit_scalar(type, [&](auto t) {
        using Limits = std::numeric_limits<decltype(t)>;
        const ValueRange range = volume.range();
        if (!range.empty() &&
            (range.min < float(Limits::min()) - 0.5f || range.max > float(Limits::max()) + 0.5f))
            text = fmt::format("values {:g} .. {:g} are limited to {} .. {}", range.min, range.max,
                               +Limits::min(), +Limits::max());
    });
    if (volume.no_data_count() > 0)
        text += fmt::format("{}{} sample{} without data become 0", text.empty() ? "" : ", ",
                            volume.no_data_count(), volume.no_data_count() == 1 ? "" : "s");
    return text;
}

} // namespace palpate
