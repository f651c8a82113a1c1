#include "engine/measure/measure_report.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace palpate {

namespace {

constexpr double kMm3PerMl = 1000.0;

void add(Json& json, const char* key, const std::optional<double>& value) {
    if (value && std::isfinite(*value))
        json[key] = *value;
}

// In the order of the columns.
struct Field {
    const char* name;
    double ValueStatistics::*member;
};
constexpr Field kFields[] = {{"mean", &ValueStatistics::mean}, {"sd", &ValueStatistics::sd},
                             {"min", &ValueStatistics::min},   {"p5", &ValueStatistics::p5},
                             {"p25", &ValueStatistics::p25},   {"median", &ValueStatistics::median},
                             {"p75", &ValueStatistics::p75},   {"p95", &ValueStatistics::p95},
                             {"max", &ValueStatistics::max}};

Json values_json(const ValueStatistics& values) {
    Json json{{"count", values.count}, {"no_data", values.no_data}};
    for (const Field& field : kFields)
        add(json, field.name, values.*field.member);
    return json;
}

std::string number(const std::optional<double>& value) {
    return value && std::isfinite(*value) ? fmt::format("{}", *value) : std::string();
}

std::string quoted(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos)
        return text;
    std::string out = "\"";
    for (const char c : text)
        out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return out + "\"";
}

// Lines of fields with names, in the order of the columns.
class Table {
 public:
    void add(const std::vector<std::pair<std::string, std::string>>& fields) {
        auto& line = lines_.emplace_back();
        for (const auto& [name, value] : fields) // of two of one name the first counts
            line.try_emplace(name, value);
    }
    // `unit`: of the values.
    std::string text(const std::string& unit) const {
        std::vector<std::string> all{"kind",      "name",      "label",    "length_mm",
                                     "angle_deg", "radius_mm", "area_mm2", "volume_mm3",
                                     "volume_ml", "count",     "no_data"};
        for (const Field& field : kFields)
            all.emplace_back(field.name);
        for (const char* name :
             {"low_x", "low_y", "low_z", "high_x", "high_y", "high_z", "centroid_x_mm",
              "centroid_y_mm", "centroid_z_mm", "sphericity", "semi_axis_1_mm", "semi_axis_2_mm",
              "semi_axis_3_mm", "axis_1", "axis_2", "axis_3", "histogram", "points_mm", "note"})
            all.emplace_back(name);
        std::erase_if(all, [&](const std::string& column) { return !is_filled(column); });
        std::string out = line(all, [&](const std::string& column) {
            return is_of_values(column) && !unit.empty() ? column + "_" + unit : column;
        });
        for (const auto& fields : lines_)
            out += line(all, [&](const std::string& column) {
                const auto found = fields.find(column);
                return found == fields.end() ? std::string() : quoted(found->second);
            });
        return out;
    }

 private:
    static bool is_of_values(const std::string& column) {
        return std::ranges::any_of(kFields, [&](const Field& one) { return column == one.name; });
    }
    bool is_filled(const std::string& column) const {
        const std::string nothing = column == "no_data" ? "0" : "";
        return column == "kind" || column == "name" ||
               std::ranges::any_of(lines_, [&](const auto& fields) {
                   const auto found = fields.find(column);
                   return found != fields.end() && !found->second.empty() &&
                          found->second != nothing;
               });
    }
    static std::string line(const std::vector<std::string>& columns,
                            const std::function<std::string(const std::string&)>& field) {
        std::string out;
        for (size_t i = 0; i < columns.size(); ++i)
            out += (i > 0 ? "," : "") + field(columns[i]);
        return out + "\r\n";
    }
    std::vector<std::map<std::string, std::string>> lines_;
};

using Fields = std::vector<std::pair<std::string, std::string>>;

void add_values(Fields& fields, const ValueStatistics& values) {
    fields.emplace_back("count", std::to_string(values.count));
    fields.emplace_back("no_data", std::to_string(values.no_data));
    for (const Field& field : kFields)
        fields.emplace_back(field.name, number(values.*field.member));
}

void add_volume(Fields& fields, const std::optional<double>& mm3) {
    fields.emplace_back("volume_mm3", number(mm3));
    if (mm3)
        fields.emplace_back("volume_ml", number(*mm3 / kMm3PerMl));
}

} // namespace

Json report_json(const MeasureReport& report) {
    Json measures = Json::array(), labels = Json::array();
    for (const MeasureReport::One& one : report.measures) {
        Json json = measure_json(one.measure);
        add(json, "length_mm", one.measured.length_mm);
        add(json, "angle_deg", one.measured.angle_deg);
        add(json, "radius_mm", one.measured.radius_mm);
        add(json, "area_mm2", one.measured.area_mm2);
        add(json, "volume_mm3", one.measured.volume_mm3);
        if (one.measured.volume_mm3)
            json["volume_ml"] = *one.measured.volume_mm3 / kMm3PerMl;
        if (one.measured.values)
            json["values"] = values_json(*one.measured.values);
        if (!one.measured.note.empty())
            json["note"] = one.measured.note;
        measures.push_back(std::move(json));
    }
    for (const MeasureReport::Label& label : report.labels) {
        const LabelStatistics& s = label.statistics;
        Json json{{"label", s.label}};
        if (!label.name.empty())
            json["name"] = label.name;
        json["count"] = s.count;
        json["volume_mm3"] = s.volume_mm3;
        json["volume_ml"] = s.volume_mm3 / kMm3PerMl;
        json["low"] = glm::dvec3(s.low);
        json["high"] = glm::dvec3(s.high);
        json["centroid_mm"] = s.centroid_mm;
        json["area_mm2"] = label.surface.area_mm2;
        json["surface_volume_mm3"] = label.surface.volume_mm3;
        json["sphericity"] = label.surface.sphericity;
        if (!label.surface.note.empty())
            json["note"] = label.surface.note;
        const PrincipalAxes axes = principal_axes(s.covariance_mm2);
        json["semi_axes_mm"] = axes.semi_axes_mm;
        Json directions = Json::array();
        for (const glm::dvec3 direction : axes.direction)
            directions.push_back(direction);
        json["axes"] = std::move(directions);
        json["values"] = values_json(s.values);
        if (!s.histogram.empty())
            json["histogram"] = {{"low", report.histogram_range.min},
                                 {"high", report.histogram_range.max},
                                 {"counts", s.histogram}};
        labels.push_back(std::move(json));
    }
    return {{"measures", std::move(measures)}, {"labels", std::move(labels)}};
}

std::string report_csv(const MeasureReport& report) {
    Table table;
    size_t row = 0;
    for (const MeasureReport::One& one : report.measures) {
        Fields fields{{"kind", name_of(one.measure.kind)},
                      {"name", listed_name(one.measure, row++)}};
        fields.emplace_back("length_mm", number(one.measured.length_mm));
        fields.emplace_back("angle_deg", number(one.measured.angle_deg));
        fields.emplace_back("radius_mm", number(one.measured.radius_mm));
        fields.emplace_back("area_mm2", number(one.measured.area_mm2));
        add_volume(fields, one.measured.volume_mm3);
        if (one.measured.values)
            add_values(fields, *one.measured.values);
        std::string points;
        for (const glm::dvec3 p : one.measure.points_mm)
            points += fmt::format("{}{} {} {}", points.empty() ? "" : "; ", p.x, p.y, p.z);
        fields.emplace_back("points_mm", points);
        fields.emplace_back("note", one.measured.note);
        table.add(fields);
    }
    for (const MeasureReport::Label& label : report.labels) {
        const LabelStatistics& s = label.statistics;
        Fields fields{{"kind", "label"}, {"name", label.name}, {"label", std::to_string(s.label)}};
        add_volume(fields, s.volume_mm3);
        add_values(fields, s.values);
        // A label's count is that of its samples, with values or without.
        for (auto& [name, value] : fields)
            if (name == "count")
                value = std::to_string(s.count);
        fields.emplace_back("area_mm2", number(label.surface.area_mm2));
        fields.emplace_back("sphericity", number(label.surface.sphericity));
        fields.emplace_back("note", label.surface.note);
        const PrincipalAxes principal = principal_axes(s.covariance_mm2);
        for (int i = 0; i < 3; ++i) {
            const glm::dvec3 d = principal.direction[size_t(i)];
            fields.emplace_back(fmt::format("semi_axis_{}_mm", i + 1),
                                number(principal.semi_axes_mm[i]));
            fields.emplace_back(fmt::format("axis_{}", i + 1),
                                fmt::format("{} {} {}", d.x, d.y, d.z));
        }
        fields.emplace_back("histogram", fmt::format("{}", fmt::join(s.histogram, " ")));
        constexpr const char* axes[] = {"x", "y", "z"};
        for (int i = 0; i < 3; ++i) {
            const std::string axis = axes[i];
            fields.emplace_back("low_" + axis, std::to_string(s.low[i]));
            fields.emplace_back("high_" + axis, std::to_string(s.high[i]));
            fields.emplace_back("centroid_" + axis + "_mm", number(s.centroid_mm[i]));
        }
        table.add(fields);
    }
    return table.text(report.unit);
}

std::string ml_text(double volume_mm3) {
    const double ml = volume_mm3 / kMm3PerMl;
    return ml >= 100.0 ? fmt::format("{:.0f} ml", ml)
           : ml >= 1.0 ? fmt::format("{:.1f} ml", ml)
                       : fmt::format("{:.3g} ml", ml);
}

std::string headline(const Measured& measured) {
    if (measured.angle_deg)
        return fmt::format("{:.1f}\u00b0", *measured.angle_deg);
    if (measured.volume_mm3)
        return ml_text(*measured.volume_mm3);
    if (measured.area_mm2)
        return *measured.area_mm2 < 1000.0
                   ? fmt::format("{:.1f} mm\u00b2", *measured.area_mm2)
                   : fmt::format("{:.1f} cm\u00b2", *measured.area_mm2 / 100.0);
    if (measured.length_mm && measured.note.empty())
        return fmt::format("{:.1f} mm", *measured.length_mm);
    return measured.note;
}

} // namespace palpate
