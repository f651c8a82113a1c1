#include "engine/session/kept.h"

namespace palpate {

Json kept_json(const Kept& kept) {
    Json json = Json::object();
    if (kept.crosshair_mm)
        json["crosshair_mm"] = *kept.crosshair_mm;
    if (kept.tool_radius_mm)
        json["tool_radius_mm"] = *kept.tool_radius_mm;
    if (kept.tool_label)
        json["tool_label"] = *kept.tool_label;
    if (!kept.isos.empty())
        json["iso_list"] = iso_list_json(kept.isos);
    return json;
}

Kept read_kept(const JsonValue& in) {
    Kept kept;
    if (const auto crosshair = in.find("crosshair_mm"))
        kept.crosshair_mm = crosshair->vector(-1e9, 1e9);
    if (const auto radius = in.find("tool_radius_mm"))
        kept.tool_radius_mm = radius->number_above(0.0, 1e6);
    if (const auto label = in.find("tool_label"))
        kept.tool_label = static_cast<uint16_t>(label->whole_number(1, 65535));
    if (const auto isos = in.find("iso_list"))
        kept.isos = read_iso_list(*isos);
    return kept;
}

} // namespace palpate
