#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace palpate {

// Colour and opacity as functions of the value; piecewise linear, constant beyond the end points.
//
// Opacity is that of a slab of opacity_unit_mm: 0 .. 1. Along a ray it acts as optical depth, tau =
// -ln(1 - opacity) / opacity_unit_mm per millimetre, so that spacing and step never change a
// picture. Colours are display values, 0 .. 1. Points are sorted by value; two points of equal
// value make a step, whose upper side counts at the value itself.
struct TransferFunction {
    struct ColorPoint {
        double value;
        glm::dvec3 color;
        friend bool operator==(const ColorPoint&, const ColorPoint&) = default;
    };
    struct OpacityPoint {
        double value;
        double opacity;
        friend bool operator==(const OpacityPoint&, const OpacityPoint&) = default;
    };
    std::vector<ColorPoint> colors;      // at least one
    std::vector<OpacityPoint> opacities; // at least one
    double opacity_unit_mm = 1.0;        // > 0; in scene files also 0: the volume's size decides

    friend bool operator==(const TransferFunction&, const TransferFunction&) = default;
};

// An opacity of 1 is capped here, so that tau stays finite: 1 - 2^-24.
constexpr double kMaxOpacity = 1.0 - 1.0 / 16777216.0;

glm::dvec3 color_at(const TransferFunction& function, double value);
double opacity_at(const TransferFunction& function, double value); // as given, not capped
double tau_per_mm_at(const TransferFunction& function, double value);

// All values at which colour or opacity has a kink or step, sorted, each once.
std::vector<double> knots(const TransferFunction& function);

// The smallest distance between neighbouring knots; 0 where two points of one value make a step.
double finest_detail(const TransferFunction& function);

// Grey from black at `low` to white at `high`, opacity from 0 to `max_opacity` over the same range.
TransferFunction window_function(double low, double high, double max_opacity,
                                 double opacity_unit_mm = 1.0);

// The function turned over within its ends: the lowest value looks as the highest did.
TransferFunction mirrored(const TransferFunction& function);

// The function sampled for the GPU: entry i stands for low + i / (n - 1) * (high - low); a value is
// looked up at the nearest entry, values outside at the ends. rgb and tau per mm.
struct TransferTable {
    double low = 0, high = 1;       // low < high
    std::vector<glm::vec4> entries; // (r, g, b, tau_per_mm)
    // Running integrals from low to entry i: of color * tau (rgb) and of tau (a), over the value,
    // divided by (high - low). The mean of tau over values a .. b is then
    // (integral(b) - integral(a)) * (high - low) / (b - a). Exact to fp64 at the entries.
    std::vector<glm::vec4> integrals;
};
// Whether the function has opacity between an entry and the next: a narrower peak shows only in the
// table's integrals.
bool shows_after(const TransferTable& table, size_t entry);

constexpr size_t kTransferTableSize = 4096;

TransferTable make_table(const TransferFunction& function, size_t size = kTransferTableSize);

} // namespace palpate
