#include "engine/annotate/strokes.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace palpate {

namespace {

// Calls cover(x, y) for the pixels of the picture that meet a box, and blends by what it returns.
template <class Cover>
void blend(Image& image, glm::dvec2 low, glm::dvec2 high, glm::dvec3 ink, const Cover& cover) {
    std::array<size_t, 3> colors{};
    constexpr std::array kNames{"R", "G", "B"};
    for (size_t c = 0; c < 3; ++c) {
        const auto index = channel_index(image, kNames[c]);
        if (!index)
            return;
        colors[c] = *index;
    }
    const auto alpha = channel_index(image, "A");
    const glm::dvec2 size(image.size_px);
    const glm::uvec2 from(glm::clamp(glm::floor(low), glm::dvec2(0.0), size));
    const glm::uvec2 to(glm::clamp(glm::ceil(high), glm::dvec2(0.0), size));
    for (uint32_t y = from.y; y < to.y; ++y)
        for (uint32_t x = from.x; x < to.x; ++x) {
            const double share = cover(x, y);
            if (share <= 0.0)
                continue;
            const auto mix = [&](size_t channel, double value) {
                float& v = image.at(x, y, channel);
                v = static_cast<float>(share * value + (1.0 - share) * double(v));
            };
            for (size_t c = 0; c < 3; ++c)
                mix(colors[c], ink[static_cast<glm::length_t>(c)]);
            if (alpha)
                mix(*alpha, 1.0);
        }
}

double distance_to(const Segment& s, glm::dvec2 p) {
    const glm::dvec2 way = s.to - s.from;
    const double length2 = glm::dot(way, way);
    const double t =
        length2 > 0.0 ? std::clamp(glm::dot(p - s.from, way) / length2, 0.0, 1.0) : 0.0;
    return glm::length(p - s.from - t * way);
}

} // namespace

void draw_strokes(Image& image, std::span<const Segment> strokes, double width_px, glm::dvec3 ink) {
    if (strokes.empty())
        return;
    const double reach = 0.5 * width_px + 0.5;
    glm::dvec2 low(1e9), high(-1e9);
    for (const Segment& s : strokes) {
        low = glm::min(low, glm::min(s.from, s.to) - reach);
        high = glm::max(high, glm::max(s.from, s.to) + reach);
    }
    // Each pixel takes the largest share that a stroke gives it, and is blended once.
    const glm::dvec2 size(image.size_px);
    const glm::ivec2 first(glm::clamp(glm::floor(low), glm::dvec2(0.0), size));
    const glm::ivec2 end(glm::clamp(glm::ceil(high), glm::dvec2(0.0), size));
    const glm::ivec2 box = end - first;
    if (box.x <= 0 || box.y <= 0)
        return;
    std::vector<double> share(static_cast<size_t>(box.x) * static_cast<size_t>(box.y));
    for (const Segment& s : strokes) {
        const glm::ivec2 from =
            glm::max(glm::ivec2(glm::floor(glm::min(s.from, s.to) - reach)) - first, glm::ivec2(0));
        const glm::ivec2 to =
            glm::min(glm::ivec2(glm::ceil(glm::max(s.from, s.to) + reach)) - first, box);
        for (int y = from.y; y < to.y; ++y)
            for (int x = from.x; x < to.x; ++x) {
                const double away = distance_to(s, glm::dvec2(first + glm::ivec2(x, y)) + 0.5);
                double& here = share[static_cast<size_t>(y) * static_cast<size_t>(box.x) +
                                     static_cast<size_t>(x)];
                here = std::max(here, std::clamp(reach - away, 0.0, 1.0));
            }
    }
    blend(image, glm::dvec2(first), glm::dvec2(end), ink, [&](uint32_t x, uint32_t y) {
        return share[(y - static_cast<size_t>(first.y)) * static_cast<size_t>(box.x) +
                     (x - static_cast<size_t>(first.x))];
    });
}

void fill_box(Image& image, glm::dvec2 low, glm::dvec2 high, glm::dvec3 ink) {
    blend(image, low, high, ink, [&](uint32_t x, uint32_t y) {
        const glm::dvec2 pixel(x, y);
        const glm::dvec2 part =
            glm::max(glm::min(high, pixel + 1.0) - glm::max(low, pixel), glm::dvec2(0.0));
        return part.x * part.y;
    });
}

void draw_strokes(Image& image, std::span<const Segment> strokes, const Pen& pen) {
    draw_strokes(image, strokes, pen.thickness_px() + 2.0 * pen.rim_px(), pen.rim);
    draw_strokes(image, strokes, pen.thickness_px(), pen.ink);
}

void draw_text(Image& image, glm::dvec2 at, glm::dvec2 anchor, std::string_view text,
               const Pen& pen) {
    const double scale = pen.line_px / kLine;
    const glm::dvec2 size(text_width_px(text, pen), kCapital * scale);
    const glm::dvec2 begin = at - anchor * size + glm::dvec2(0.0, size.y); // of the baseline
    std::vector<Segment> strokes = text_strokes(text);
    for (Segment& s : strokes)
        for (glm::dvec2* end : {&s.from, &s.to})
            *end = begin + scale * glm::dvec2(end->x, -end->y);
    draw_strokes(image, strokes, pen);
}

double text_width_px(std::string_view text, const Pen& pen) {
    return text_width(text) * pen.line_px / kLine;
}

Image with_straight_alpha(Image image) {
    const auto alpha = channel_index(image, "A");
    if (!alpha)
        return image;
    for (const char* name : {"R", "G", "B"})
        if (const auto channel = channel_index(image, name))
            for (uint32_t y = 0; y < image.size_px.y; ++y)
                for (uint32_t x = 0; x < image.size_px.x; ++x) {
                    const float a = image.at(x, y, *alpha);
                    float& v = image.at(x, y, *channel);
                    v = a > 0.0f ? std::min(v / a, 1.0f) : 0.0f;
                }
    return image;
}

} // namespace palpate
