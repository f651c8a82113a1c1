#include "translator.h"

namespace translator {

// OpTypeImage of a variable: in[1] dimension, in[3] whether it has layers.
const Instruction& Translator::image_type(uint32_t variable) const {
    const Instruction& type = module_.at(module_.at(module_.at(variable).type).in[1]);
    return type.op == kTypeSampledImage ? module_.at(type.in[0]) : type;
}

namespace {

uint32_t dimensions(const Instruction& image) {
    if (image.in[1] > 2)
        fail("an image of dimension {}", image.in[1]);
    return image.in[1] + 1;
}

} // namespace

// x, y, z with the layer as z.
std::string Translator::coordinates(const Instruction& image, const Parts& at, bool floats,
                                    bool& uniform) {
    const uint32_t count = dimensions(image);
    Parts all(3, literal(floats ? 'f' : 'u', 0));
    for (uint32_t axis = 0; axis < count; ++axis)
        all[axis] = at[axis];
    if (image.in[3] != 0)
        all[2] = at[count];
    uniform = all[0].uniform && all[1].uniform && all[2].uniform;
    return fmt::format("{}, {}, {}", lanes(all[0]), lanes(all[1]), lanes(all[2]));
}

bool Translator::image_instruction(const Instruction& one) {
    const auto image_of = [&] { return images_.at(one.in[0]); };
    switch (one.op) {
        case kImage:
            images_[one.id] = image_of();
            return true;
        case kImageQuerySize:
        case kImageQuerySizeLod: {
            const Instruction& type = image_type(image_of());
            const uint32_t count = dimensions(type);
            Parts out;
            for (uint32_t i = 0; i < count + type.in[3]; ++i)
                out.push_back(
                    define(fmt::format("v{}_{}", one.id, i), 'u', true,
                           fmt::format("size_of(x{}, {})", image_of(), i == count ? 2u : i)));
            values_[one.id] = out;
            return true;
        }
        case kImageWrite: {
            bool uniform = false;
            const std::string at =
                coordinates(image_type(image_of()), parts(one.in[1]), false, uniform);
            std::string channels;
            Parts texel = parts(one.in[2]);
            texel.resize(4, literal('u', 0));
            for (const Part& part : texel)
                channels += part.kind == 'f' ? fmt::format("as_uint({}), ", lanes(part))
                                             : lanes(part) + ", ";
            line(fmt::format("store(x{}, {}, {}{});", image_of(), at, channels, mask()));
            return true;
        }
        case kImageFetch:
        case kImageRead:
        case kImageSampleExplicitLod:
            break;
        default:
            return false;
    }
    const bool samples = one.op == kImageSampleExplicitLod;
    const Instruction& type = image_type(image_of());
    const std::string kinds = module_.scalars(one.type);
    const auto name = [&](size_t i) { return fmt::format("v{}_{}", one.id, i); };
    bool is_wanted_at_all = false, one_channel = true;
    for (size_t i = 0; i < kinds.size(); ++i) {
        is_wanted_at_all |= is_wanted(name(i));
        one_channel &= i == 0 || !is_wanted(name(i));
    }
    bool uniform = true;
    const Parts place = parts(one.in[1]);
    std::string all;
    if (is_wanted_at_all) {
        all = coordinates(type, place, samples, uniform);
        const std::string of =
            samples ? fmt::format("sample<{}>(x{}, {}, ", one_channel, image_of(), dimensions(type))
                    : fmt::format("fetch<{}>(x{}, ", one_channel, image_of());
        line(fmt::format("const auto q{} = {}{}, {});", one.id, of, all,
                         uniform ? "B(true)" : mask()));
    } else {
        for (const Part& part : place)
            uniform &= part.uniform;
    }
    Parts out;
    for (size_t i = 0; i < kinds.size(); ++i) {
        std::string value = fmt::format("q{}.c[{}]", one.id, i);
        if (uniform)
            value = fmt::format("lane_of({}, 0)", value);
        if (kinds[i] == 'f')
            value = fmt::format("as_float({})", value);
        out.push_back(define(name(i), kinds[i], uniform, value));
    }
    values_[one.id] = out;
    return true;
}

} // namespace translator
