#include "engine/session/touch_json.h"

#include <algorithm>

namespace palpate {

namespace {

using namespace haptics;

struct Amount {
    const char* key;
    double TouchParameters::*member;
    double low, high;
};
constexpr Amount kAmounts[] = {
    {"iso", &TouchParameters::iso, -MostTouch::value, MostTouch::value},
    {"tool_radius_mm", &TouchParameters::tool_radius_mm, 0, MostTouch::radius_mm},
    {"stiffness_n_per_m", &TouchParameters::stiffness_n_per_m, 0, MostTouch::stiffness_n_per_m},
    {"damping_n_s_per_m", &TouchParameters::damping_n_s_per_m, 0, MostTouch::damping_n_s_per_m},
    {"friction_static", &TouchParameters::friction_static, 0, MostTouch::friction},
    {"friction_dynamic", &TouchParameters::friction_dynamic, 0, MostTouch::friction},
    {"yield_n", &TouchParameters::yield_n, 0, MostTouch::force_n},
    {"viscosity_n_s_per_m", &TouchParameters::viscosity_n_s_per_m, 0, MostTouch::damping_n_s_per_m},
    {"vibration_n", &TouchParameters::vibration_n, 0, MostTouch::force_n},
    {"normal_blur_samples", &TouchParameters::normal_blur_samples, 0, 1},
    {"edge_samples", &TouchParameters::edge_samples, 0, 1},
    {"surface_delay_s", &TouchParameters::surface_delay_s, 0, MostTouch::delay_s},
    {"drill_threshold_mm", &TouchParameters::drill_threshold_mm, 0, MostTouch::drill_mm},
};
constexpr const char* kAxes[] = {"transfer_x", "transfer_y", "transfer_z"};

Json transfer_json(const HapticTransfer& transfer) {
    Json points = Json::array();
    for (uint32_t i = 0; i < transfer.point_count; ++i)
        points.push_back({transfer.values[i], transfer.forces_n[i]});
    return {{"strength_n", transfer.strength_n},
            {"center", transfer.center},
            {"width", transfer.width},
            {"points", std::move(points)}};
}

HapticTransfer read_transfer(const JsonValue& in) {
    in.only_keys({"strength_n", "center", "width", "points"});
    HapticTransfer transfer;
    in.take("strength_n", transfer.strength_n, -MostTouch::force_n, MostTouch::force_n);
    in.take("center", transfer.center, -MostTouch::value, MostTouch::value);
    in.take("width", transfer.width, -MostTouch::value, MostTouch::value);
    if (const auto points = in.find("points"))
        for (const JsonValue& point : points->items(0, HapticTransfer::kMostPoints)) {
            const auto pair = point.items(2, 2);
            if (pair.size() != 2)
                break;
            const uint32_t at = transfer.point_count++;
            transfer.values[at] = pair[0].number(-MostTouch::value, MostTouch::value);
            transfer.forces_n[at] = pair[1].number(-MostTouch::force_n, MostTouch::force_n);
            if (at > 0 && !(transfer.values[at - 1] < transfer.values[at]))
                point.complain("expected values that rise from point to point");
        }
    return transfer;
}

Json label_json(const LabelTouch& label) {
    return {{"label", label.label},
            {"stiffness_n_per_m", label.stiffness_n_per_m},
            {"friction_static", label.friction_static},
            {"friction_dynamic", label.friction_dynamic},
            {"yield_n", label.yield_n}};
}

LabelTouch read_label(const JsonValue& in) {
    in.only_keys({"label", "stiffness_n_per_m", "friction_static", "friction_dynamic", "yield_n"});
    LabelTouch label;
    in.take("label", label.label, 0, 65535);
    in.take("stiffness_n_per_m", label.stiffness_n_per_m, 0, MostTouch::stiffness_n_per_m);
    in.take("friction_static", label.friction_static, 0, MostTouch::friction);
    in.take("friction_dynamic", label.friction_dynamic, 0, MostTouch::friction);
    in.take("yield_n", label.yield_n, 0, MostTouch::force_n);
    return label;
}

} // namespace

Json touch_parameters_json(const TouchParameters& parameters) {
    Json out = Json::object();
    for (const Amount& amount : kAmounts)
        out[amount.key] = parameters.*amount.member;
    out["tool_samples"] = parameters.tool_samples;
    out["source"] = parameters.source == TouchSource::labels ? "labels" : "grey";
    for (size_t axis = 0; axis < 3; ++axis)
        out[kAxes[axis]] = transfer_json(parameters.transfer[axis]);
    out["opacity"] = transfer_json(parameters.opacity);
    Json labels = Json::array();
    for (uint32_t i = 0; i < parameters.label_count; ++i)
        labels.push_back(label_json(parameters.labels[i]));
    out["labels"] = std::move(labels);
    return out;
}

TouchParameters read_touch_parameters(const JsonValue& in) {
    TouchParameters out;
    for (const auto& [key, value] : in.json().members) {
        const JsonValue member = *in.find(key);
        const auto named = [&, name = std::string_view(key)](const char* other) {
            return name == other;
        };
        const auto amount = std::find_if(std::begin(kAmounts), std::end(kAmounts),
                                         [&](const Amount& a) { return named(a.key); });
        const auto axis = std::find_if(std::begin(kAxes), std::end(kAxes), named);
        if (amount != std::end(kAmounts))
            out.*amount->member = member.number(amount->low, amount->high);
        else if (axis != std::end(kAxes))
            out.transfer[static_cast<size_t>(axis - std::begin(kAxes))] = read_transfer(member);
        else if (named("opacity"))
            out.opacity = read_transfer(member);
        else if (named("tool_samples"))
            out.tool_samples = member.whole_number(1, MostTouch::samples);
        else if (named("source"))
            out.source = member.choice<TouchSource>(
                {{"grey", TouchSource::grey}, {"labels", TouchSource::labels}});
        else if (named("labels"))
            for (const JsonValue& label : member.items(0, TouchParameters::kMostLabels))
                out.labels[out.label_count++] = read_label(label);
        else if (!named("free_value") && !named("solid_value")) // files of before have these
            member.complain("expected no other key than those of haptic parameters");
    }
    return out;
}

} // namespace palpate
