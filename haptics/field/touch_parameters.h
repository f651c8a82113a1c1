#pragma once

#include <array>
#include <cstdint>

#include "engine/base/setting.h"

// How touch feels: the parameters of all algorithms, and the table of what they are.
namespace palpate::haptics {

// Upper limits that several settings share. Outside the limits of its settings every tick returns
// Contact::unknown and no force.
struct MostTouch {
    static constexpr double radius_mm = 1e4, stiffness_n_per_m = 1e6, damping_n_s_per_m = 1e5,
                            friction = 100.0, force_n = 1e4, value = 1e30, delay_s = 10.0;
    static constexpr uint32_t samples = 4096;
};

// The part of a scene that is felt.
enum class TouchSource : uint8_t { grey, labels };

// How strong a constraint is where the grey value is I: the haptic transfer functions of Nystroem
// et al. (WISH). Sigmoid: strength_n / (1 + exp(-(I - center) / width)); width 0 is a constant.
// Table: straight between points of rising value, level beyond them.
struct HapticTransfer {
    double strength_n = 0.0; // A: the largest force
    double center = 0.0;     // beta, in value units
    double width = 0.0;      // alpha, in value units
    static constexpr uint32_t kMostPoints = 8;
    uint32_t point_count = 0; // above 0: the table, not the sigmoid
    std::array<double, kMostPoints> values{}, forces_n{};

    friend bool operator==(const HapticTransfer&, const HapticTransfer&) = default;
};
// Finite for every finite value.
double strength_n(const HapticTransfer& transfer, double value);

// Haptic properties of one label.
struct LabelTouch {
    uint32_t label = 0;
    double stiffness_n_per_m = 500.0;
    double friction_static = 0.0, friction_dynamic = 0.0;
    double yield_n = 0.0;

    friend bool operator==(const LabelTouch&, const LabelTouch&) = default;
};

// Parameters of touch; kTouchSettings says what each does. An algorithm reads those that apply to
// it.
struct TouchParameters {
    static constexpr uint32_t kMostLabels = 16;

    double iso = 0.5;
    double tool_radius_mm = 0.0;
    uint32_t tool_samples = 340;
    double stiffness_n_per_m = 500.0;
    double damping_n_s_per_m = 0.0;
    double friction_static = 0.0;
    double friction_dynamic = 0.0; // at most the static one
    double yield_n = 0.0;          // 0 is never
    double viscosity_n_s_per_m = 0.0;
    double air_drag_n_s_per_m = 0.0;
    double vibration_n = 0.0;
    TouchSource source = TouchSource::grey;
    // Standard deviations, measured by tune() in field.h: of the blur of normals against noise, and
    // of the edge in which the surface lies, in spacings of the coarsest axis; the narrower the
    // edge, the more are normals blurred without noise.
    double normal_blur_samples = 1.0, edge_samples = 0.0;
    std::array<HapticTransfer, 3> transfer{}; // of the axes of the local frame, for motion rules
    HapticTransfer opacity{};                 // of local surfaces, where it is a table
    double surface_delay_s = 0.03;
    double drill_threshold_mm = 2.0;
    uint32_t label_count = 0; // of `labels`; others feel as the fields above say
    std::array<LabelTouch, kMostLabels> labels{};
};

// Parameters and parts of a scene that some algorithms read and others do not: a bit each.
enum Takes : uint32_t {
    kTakesSource = 1u << 0,   // grey values or labels, as TouchParameters::source says
    kTakesLabels = 1u << 1,   // TouchParameters::labels
    kTakesRadius = 1u << 2,   // of a ball
    kTakesSamples = 1u << 3,  // of the ball's surface
    kTakesTool = 1u << 4,     // TouchScene::tool
    kTakesMesh = 1u << 5,     // TouchScene::touch_mesh
    kTakesField = 1u << 6,    // TouchScene::field, as a vector field
    kTakesFriction = 1u << 7, // the dynamic coefficient
    kTakesStiction = 1u << 8, // the static coefficient
    kTakesYield = 1u << 9,
    kTakesDrag = 1u << 10, // inside of matter, and in the air
    kTakesVibration = 1u << 11,
    kTakesTransfer = 1u << 12, // along the first axis of the local frame
    kTakesAcross = 1u << 13,   // along the other axes
    kTakesOpacity = 1u << 14,
    kTakesDelay = 1u << 15, // of a local surface
    kTakesDrill = 1u << 16, // a depth at which drilling begins, and no button
};

// The numbers among the parameters; a new one needs a member, a row and its use.
// clang-format off
inline constexpr Setting<TouchParameters> kTouchSettings[] = {
    {"iso", &TouchParameters::iso, -MostTouch::value, MostTouch::value, "",
     "Values at or above it are solid, in the volume's units",
     {.option = "iso", .by_default = "300 HU for CT, else half of the range",
      .slew = Slew::straight}},
    {"tool_radius_mm", &TouchParameters::tool_radius_mm, 0, MostTouch::radius_mm, "mm",
     "Radius of the tool; 0 is a point",
     {.option = "radius", .of = kTakesRadius,
      .slew = Slew::straight}},
    {"stiffness_n_per_m",
     &TouchParameters::stiffness_n_per_m, 0, MostTouch::stiffness_n_per_m, "N/m",
     "Spring between the hand and the tool on the surface",
     {.option = "stiffness", .slew = Slew::straight, .slider = {"stiffness", 3000.0, 0}}},
    {"damping_n_s_per_m",
     &TouchParameters::damping_n_s_per_m, 0, MostTouch::damping_n_s_per_m, "N s/m",
     "Damper beside that spring",
     {.option = "damping", .slew = Slew::straight, .slider = {"damping", 20.0, 1}}},
    {"friction_static", &TouchParameters::friction_static, 0, MostTouch::friction, "",
     "Coulomb coefficient that holds a tool at rest; 0 is frictionless",
     {.option = "friction", .of = kTakesStiction,
      .slew = Slew::straight, .slider = {"stiction", 1.5}}},
    {"friction_dynamic", &TouchParameters::friction_dynamic, 0, MostTouch::friction, "",
     "Coulomb coefficient of a tool that slides, at most the static one",
     {.option = "friction", .keyword = "friction_dynamic",
      .of = kTakesFriction,
      .slew = Slew::straight, .slider = {"friction", 1.5}}},
    {"yield_n", &TouchParameters::yield_n, 0, MostTouch::force_n, "N",
     "T0, the force above which material yields; 0 is never, also where a print's rule would "
     "make it no resistance",
     {.option = "yield", .keyword = "yield_force", .of = kTakesYield,
      .slew = Slew::inverse, .slider = {"T0", 8.0}}},
    {"viscosity_n_s_per_m",
     &TouchParameters::viscosity_n_s_per_m, 0, MostTouch::damping_n_s_per_m, "N s/m",
     "Drag inside of what can be entered",
     {.option = "viscosity", .of = kTakesDrag,
      .slew = Slew::straight, .slider = {"viscosity", 20.0, 1}}},
    {"air_drag_n_s_per_m",
     &TouchParameters::air_drag_n_s_per_m, 0, MostTouch::damping_n_s_per_m, "N s/m",
     "Drag wherever the tool is, which steadies a hand in free space, too",
     {.option = "air-drag", .of = kTakesDrag,
      .slew = Slew::straight, .slider = {"air drag", 20.0, 1}}},
    {"vibration_n", &TouchParameters::vibration_n, 0, MostTouch::force_n, "N",
     "Amplitude of the vibration; it follows how much material the tool removes a second and how "
     "hard that is",
     {.option = "vibration", .of = kTakesVibration,
      .slew = Slew::straight, .slider = {"vibration", 1.0}}},
    {"normal_blur_samples", &TouchParameters::normal_blur_samples, 0, 1, "samples",
     "Blur of normals against noise: 1 for noise of 10 % of the contrast, 0.6 for 2 %, 0 for "
     "clean data; measured at the start"},
    {"edge_samples", &TouchParameters::edge_samples, 0, 1, "samples",
     "How wide the edge is that the surface lies in; measured at the start"},
    {"surface_delay_s", &TouchParameters::surface_delay_s, 0, MostTouch::delay_s, "s",
     "Time until another thread has made the local surface",
     {.option = "surface-delay", .of = kTakesDelay, .slider = {"delay", 0.2, 3}}},
    {"drill_threshold_mm", &TouchParameters::drill_threshold_mm, 0, MostTouch::radius_mm, "mm",
     "Distance from the surface to the hand above which material is removed",
     {.option = "drill-threshold", .of = kTakesDrill, .slider = {"drag from", 10.0, 1}}},
    {"tool_samples", &TouchParameters::tool_samples, 1, MostTouch::samples, "",
     "Samples of the point shell of a tool",
     {.option = "samples", .of = kTakesSamples}},
};

inline constexpr Setting<LabelTouch> kLabelSettings[] = {
    {"label", &LabelTouch::label, 0, 65535, "",
     "Which label"},
    {"stiffness_n_per_m", &LabelTouch::stiffness_n_per_m, 0, MostTouch::stiffness_n_per_m, "N/m",
     "Spring where it is touched"},
    {"friction_static", &LabelTouch::friction_static, 0, MostTouch::friction, "",
     "Coulomb coefficient at rest"},
    {"friction_dynamic", &LabelTouch::friction_dynamic, 0, MostTouch::friction, "",
     "Coulomb coefficient of a tool that slides"},
    {"yield_n", &LabelTouch::yield_n, 0, MostTouch::force_n, "N",
     "T0, the force above which it yields; 0 is never"},
};

inline constexpr Setting<HapticTransfer> kTransferSettings[] = {
    {"strength_n", &HapticTransfer::strength_n, -MostTouch::force_n, MostTouch::force_n, "N",
     "The largest force"},
    {"center", &HapticTransfer::center, -MostTouch::value, MostTouch::value, "",
     "Value of half of it"},
    {"width", &HapticTransfer::width, -MostTouch::value, MostTouch::value, "",
     "How far around it the force rises; 0 is a constant"},
};
// clang-format on

} // namespace palpate::haptics
