#include "engine/session/touch_json.h"

namespace palpate {

namespace {

using namespace haptics;

constexpr const char* kAxes[] = {"transfer_x", "transfer_y", "transfer_z"};

Json transfer_json(const HapticTransfer& transfer) {
    Json out = settings_json<HapticTransfer>(transfer, kTransferSettings);
    Json points = Json::array();
    for (uint32_t i = 0; i < transfer.point_count; ++i)
        points.push_back({transfer.values[i], transfer.forces_n[i]});
    out["points"] = std::move(points);
    return out;
}

HapticTransfer read_transfer(const JsonValue& in) {
    in.only_keys(keys_of<HapticTransfer>(kTransferSettings, {"points"}));
    HapticTransfer transfer;
    read_settings<HapticTransfer>(in, transfer, kTransferSettings);
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

LabelTouch read_label(const JsonValue& in) {
    in.only_keys(keys_of<LabelTouch>(kLabelSettings));
    LabelTouch label;
    read_settings<LabelTouch>(in, label, kLabelSettings);
    return label;
}

} // namespace

Json touch_parameters_json(const TouchParameters& parameters) {
    Json out = settings_json<TouchParameters>(parameters, kTouchSettings);
    out["source"] = parameters.source == TouchSource::labels ? "labels" : "grey";
    for (size_t axis = 0; axis < 3; ++axis)
        out[kAxes[axis]] = transfer_json(parameters.transfer[axis]);
    out["opacity"] = transfer_json(parameters.opacity);
    Json labels = Json::array();
    for (uint32_t i = 0; i < parameters.label_count; ++i)
        labels.push_back(settings_json<LabelTouch>(parameters.labels[i], kLabelSettings));
    out["labels"] = std::move(labels);
    return out;
}

TouchParameters read_touch_parameters(const JsonValue& in) {
    in.only_keys(keys_of<TouchParameters>(
        kTouchSettings, {"source", kAxes[0], kAxes[1], kAxes[2], "opacity", "labels", "free_value",
                         "solid_value"})); // the last two stand in files of before
    TouchParameters out;
    read_settings<TouchParameters>(in, out, kTouchSettings);
    if (const auto source = in.find("source"))
        out.source = source->choice<TouchSource>(
            {{"grey", TouchSource::grey}, {"labels", TouchSource::labels}});
    for (size_t axis = 0; axis < 3; ++axis)
        if (const auto transfer = in.find(kAxes[axis]))
            out.transfer[axis] = read_transfer(*transfer);
    if (const auto opacity = in.find("opacity"))
        out.opacity = read_transfer(*opacity);
    if (const auto labels = in.find("labels"))
        for (const JsonValue& label : labels->items(0, TouchParameters::kMostLabels))
            out.labels[out.label_count++] = read_label(label);
    return out;
}

} // namespace palpate
