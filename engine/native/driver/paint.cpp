// Rasterises the interface's triangles.

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>

#include "engine/native/driver/objects.h"

namespace palpate::native::driver {

namespace {

struct Vertex {
    std::array<float, 2> position, place;
    std::array<uint8_t, 4> color;
};
static_assert(sizeof(Vertex) == 20);

// Positions are rounded to 1/256 pixel, as subPixelPrecisionBits says: then the edges of neighbours
// are the same numbers, and a pixel on a common edge belongs to one of them alone.
constexpr int64_t kOne = 256;
constexpr int kRowsPerTask = 32;

using Four = float __attribute__((vector_size(16)));
using Color = Four; // red, green, blue, alpha; 0 to 255

// A value that changes linearly over the target: at x, y (pixels) it is first + dx * x + dy * y.
struct Ramp {
    double first = 0, dx = 0, dy = 0;
    float at(int x, int y) const {
        return static_cast<float>(first + dx * (x + 0.5) + dy * (y + 0.5));
    }
    bool is_flat() const { return dx == 0 && dy == 0; }
};

// A side of a triangle: pixels whose centre has a * x + b * y + c >= 0 are within.
struct Side {
    int64_t a, b, c; // of whole pixels, counted from the first one's centre
};

struct Triangle {
    std::array<Side, 3> sides;
    std::array<Ramp, 6> ramps; // place in the texture, then colour
    int low_y, high_y;         // rows it may reach; high_y is the first beyond
    std::optional<Color> tint; // of every corner, if there is one; 0 to 1
    std::optional<Color> flat; // the colour of every pixel, if there is one
};

int64_t floor_divide(int64_t a, int64_t b) { // b > 0
    return a >= 0 ? a / b : -((-a + b - 1) / b);
}

// Points on the side itself belong to the triangle at its top or left, with y down.
Side side_of(std::array<int64_t, 2> from, std::array<int64_t, 2> to) {
    const int64_t dx = to[0] - from[0], dy = to[1] - from[1];
    // The cross product with a point's offset, in 1/256^2 pixels.
    const int64_t a = -dy, b = dx;
    int64_t c = dy * from[0] - dx * from[1];
    const bool is_top_left = dy < 0 || (dy == 0 && dx > 0);
    if (!is_top_left)
        c -= 1;
    // Taken at pixel centres: x = 256 * i + 128.
    return {a * kOne, b * kOne, c + (a + b) * (kOne / 2)};
}

using ByteFour = uint8_t __attribute__((vector_size(4)));

ByteFour four_at(const std::byte* texel) {
    ByteFour four;
    std::memcpy(&four, texel, 4);
    return four;
}

Color color_of(const std::byte* texel) {
    return __builtin_convertvector(four_at(texel), Color);
}

const std::byte* texel_at(const native::Image& image, int x, int y) {
    x = std::clamp(x, 0, static_cast<int>(image.width) - 1);
    y = std::clamp(y, 0, static_cast<int>(image.height) - 1);
    return image.texels + 4 * static_cast<int64_t>(x) + y * image.row_bytes;
}

Color sampled(const Resource& texture, float u, float v) {
    const native::Image& image = texture.image;
    const float x = u * static_cast<float>(image.width), y = v * static_cast<float>(image.height);
    if (!texture.sampler.is_linear)
        return color_of(
            texel_at(image, static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y))));
    const float low_x = std::floor(x - 0.5f), low_y = std::floor(y - 0.5f);
    const float right = x - 0.5f - low_x, below = y - 0.5f - low_y;
    const int i = static_cast<int>(low_x), j = static_cast<int>(low_y);
    const auto mixed = [](Color a, Color b, float share) { return a + share * (b - a); };
    const auto row = [&](int at) {
        return mixed(color_of(texel_at(image, i, at)), color_of(texel_at(image, i + 1, at)), right);
    };
    return mixed(row(j), row(j + 1), below);
}

// A colour as whole numbers in the order of a target's texels; alpha is the last.
using Bytes = uint32_t __attribute__((vector_size(16)));

Bytes bytes_of(Color color, bool is_bgra) {
    using Whole = int32_t __attribute__((vector_size(16)));
    color = color > 0.0f ? color : Color{};
    color = color < 255.0f ? color : Color{} + 255.0f;
    const Bytes bytes = (Bytes) __builtin_convertvector(color + 0.5f, Whole);
    return is_bgra ? Bytes{bytes[2], bytes[1], bytes[0], bytes[3]} : bytes;
}

// Lays a colour over a texel of 8 bits a channel by its alpha.
void blend(std::byte* texel, Bytes color) {
    const uint32_t alpha = color[3];
    const Bytes shares{alpha, alpha, alpha, 255};
    const Bytes below = (Bytes) __builtin_convertvector(four_at(texel), Bytes);
    const Bytes sum = color * shares + below * (255 - alpha) + 127;
    // A quotient by 255 of up to 16 bits.
    const auto bytes = __builtin_convertvector((sum + 1 + (sum >> 8)) >> 8, ByteFour);
    std::memcpy(texel, &bytes, 4);
}

void blend_all(std::byte* texels, int count, Bytes color) {
    if (color[3] == 0)
        return;
    if (color[3] < 255) {
        for (int i = 0; i < count; ++i)
            blend(texels + 4 * i, color);
        return;
    }
    std::array<uint8_t, 4> texel;
    for (size_t i = 0; i < 4; ++i)
        texel[i] = static_cast<uint8_t>(color[i]);
    for (int i = 0; i < count; ++i)
        std::memcpy(texels + 4 * i, texel.data(), 4);
}

Vertex vertex_of(const DrawTriangles& draw, uint32_t i) {
    const std::byte* indices = draw.indices->data + draw.index_offset;
    const uint64_t at = uint64_t{draw.first_index} + i;
    uint32_t index = 0;
    if (draw.has_long_indices)
        std::memcpy(&index, indices + 4 * at, 4);
    else {
        uint16_t low = 0;
        std::memcpy(&low, indices + 2 * at, 2);
        index = low;
    }
    Vertex vertex;
    std::memcpy(&vertex,
                draw.vertices->data + draw.vertex_offset +
                    static_cast<uint64_t>(int64_t{index} + draw.first_vertex) * sizeof vertex,
                sizeof vertex);
    for (size_t axis = 0; axis < 2; ++axis) // from the interface's pixels to those of the target
        vertex.position[axis] *=
            static_cast<float>(axis == 0 ? draw.target.width : draw.target.height) /
            draw.size_px[axis];
    return vertex;
}

std::array<Ramp, 6> ramps_of(const std::array<Vertex, 3>& v) {
    const auto value = [](const Vertex& one, size_t i) {
        return i < 2 ? double{one.place[i]} : one.color[i - 2] / 255.0;
    };
    const auto offset = [&](size_t i, size_t axis) {
        return double{v[i].position[axis]} - double{v[0].position[axis]};
    };
    const double x1 = offset(1, 0), y1 = offset(1, 1), x2 = offset(2, 0), y2 = offset(2, 1);
    const double area = x1 * y2 - x2 * y1;
    std::array<Ramp, 6> ramps;
    for (size_t i = 0; i < 6; ++i) {
        const double d1 = value(v[1], i) - value(v[0], i), d2 = value(v[2], i) - value(v[0], i);
        Ramp& ramp = ramps[i];
        if (area != 0) {
            ramp.dx = (d1 * y2 - d2 * y1) / area;
            ramp.dy = (d2 * x1 - d1 * x2) / area;
        }
        ramp.first = value(v[0], i) - ramp.dx * double{v[0].position[0]} -
                     ramp.dy * double{v[0].position[1]};
    }
    return ramps;
}

Color tint_at(const Triangle& triangle, int x, int y) {
    Color tint;
    for (size_t i = 0; i < 4; ++i)
        tint[i] = triangle.ramps[2 + i].at(x, y);
    return tint;
}

std::optional<Triangle> triangle_of(const DrawTriangles& draw, uint32_t first) {
    std::array<Vertex, 3> v;
    std::array<std::array<int64_t, 2>, 3> at;
    for (uint32_t i = 0; i < 3; ++i) {
        v[i] = vertex_of(draw, first + i);
        for (size_t axis = 0; axis < 2; ++axis) {
            if (!(std::fabs(v[i].position[axis]) < 65536.0f))
                return std::nullopt; // beyond every image; also NaN
            at[i][axis] = std::lround(v[i].position[axis] * static_cast<float>(kOne));
        }
    }
    const int64_t area = (at[1][0] - at[0][0]) * (at[2][1] - at[0][1]) -
                         (at[2][0] - at[0][0]) * (at[1][1] - at[0][1]);
    if (area == 0)
        return std::nullopt;
    Triangle made;
    made.ramps = ramps_of(v);
    if (area < 0)
        std::swap(at[1], at[2]);
    for (size_t i = 0; i < 3; ++i)
        made.sides[i] = side_of(at[i], at[(i + 1) % 3]);
    const auto [low, high] = std::minmax({at[0][1], at[1][1], at[2][1]});
    made.low_y = static_cast<int>(floor_divide(low, kOne));
    made.high_y = static_cast<int>(floor_divide(high, kOne)) + 1;
    const auto flat = [](const Ramp& ramp) { return ramp.is_flat(); };
    if (std::all_of(made.ramps.begin() + 2, made.ramps.end(), flat))
        made.tint = tint_at(made, 0, 0);
    if (made.tint && made.ramps[0].is_flat() && made.ramps[1].is_flat())
        made.flat =
            *made.tint * sampled(draw.texture, made.ramps[0].at(0, 0), made.ramps[1].at(0, 0));
    return made;
}

int clamped(int64_t value, int low, int high) {
    return static_cast<int>(std::clamp<int64_t>(value, low, high));
}

void paint_row(const DrawTriangles& draw, const Triangle& triangle, int y, int low, int high) {
    for (const Side& side : triangle.sides) {
        const int64_t rest = side.b * y + side.c; // a * x + rest >= 0
        if (side.a > 0)
            low = clamped(-floor_divide(rest, side.a), low, high);
        else if (side.a < 0)
            high = clamped(floor_divide(rest, -side.a) + 1, low, high);
        else if (rest < 0)
            return;
    }
    const bool is_bgra = draw.target.format == VK_FORMAT_B8G8R8A8_UNORM;
    std::byte* row = draw.target.texels + y * draw.target.row_bytes;
    if (triangle.flat)
        return blend_all(row + 4 * low, std::max(0, high - low), bytes_of(*triangle.flat, is_bgra));
    for (int x = low; x < high; ++x) {
        const Color tint = triangle.tint ? *triangle.tint : tint_at(triangle, x, y);
        const Color texel =
            sampled(draw.texture, triangle.ramps[0].at(x, y), triangle.ramps[1].at(x, y));
        blend(row + 4 * x, bytes_of(tint * texel, is_bgra));
    }
}

struct Bounds {
    int low_x, low_y, high_x, high_y; // the last two are the first beyond
};

Bounds bounds_of(const VkRect2D& rectangle, const native::Image& target) {
    const auto within = [](int64_t value, uint32_t most) {
        return static_cast<int>(std::clamp<int64_t>(value, 0, most));
    };
    return {within(rectangle.offset.x, target.width), within(rectangle.offset.y, target.height),
            within(int64_t{rectangle.offset.x} + rectangle.extent.width, target.width),
            within(int64_t{rectangle.offset.y} + rectangle.extent.height, target.height)};
}

} // namespace

void execute(const DrawTriangles& draw) {
    const Bounds bounds = bounds_of(draw.scissor, draw.target);
    std::vector<Triangle> triangles;
    for (uint32_t i = 0; i + 2 < draw.count; i += 3)
        if (const auto triangle = triangle_of(draw, i))
            triangles.push_back(*triangle);
    tbb::parallel_for(tbb::blocked_range<int>(bounds.low_y, bounds.high_y, kRowsPerTask),
                      [&](const tbb::blocked_range<int>& rows) {
                          for (const Triangle& triangle : triangles) {
                              const int low = std::max(rows.begin(), triangle.low_y);
                              const int high = std::min(rows.end(), triangle.high_y);
                              for (int y = low; y < high; ++y)
                                  paint_row(draw, triangle, y, bounds.low_x, bounds.high_x);
                          }
                      });
}

void execute(const ClearRectangles& clear) {
    for (const VkRect2D& rectangle : clear.rectangles) {
        const Bounds bounds = bounds_of(rectangle, clear.target);
        for (int y = bounds.low_y; y < bounds.high_y; ++y)
            for (int x = bounds.low_x; x < bounds.high_x; ++x)
                std::memcpy(clear.target.texels + y * clear.target.row_bytes + 4 * x,
                            clear.texel.data(), 4);
    }
}

} // namespace palpate::native::driver
