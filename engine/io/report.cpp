#include "engine/io/report.h"

#include <unistd.h>

#include <bit>
#include <cerrno>
#include <charconv>

#include "engine/base/json_value.h"

namespace palpate::io {

namespace {

// Doubles travel as their bits: NaN and infinities have no JSON, and a grid must not change.
Json bits(double value) {
    return fmt::format("{:016x}", std::bit_cast<uint64_t>(value));
}

double from_bits(const JsonValue& in) {
    const std::string text = in.text();
    uint64_t word = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), word, 16);
    if (error != std::errc() || end != text.data() + text.size())
        in.reject("the bits of a number");
    return std::bit_cast<double>(word);
}

Json size_json(glm::uvec3 size) {
    return {size.x, size.y, size.z};
}

glm::uvec3 size_from(const JsonValue& in) {
    const std::vector<JsonValue> sides = in.items(3, 3);
    glm::uvec3 size{};
    for (size_t axis = 0; axis < sides.size(); ++axis)
        size[static_cast<int>(axis)] = sides[axis].whole_number(0, ~0u);
    return size;
}

std::vector<JsonValue> list(const JsonValue& in) {
    return in.items(0, in.json().items.size());
}

// As many doubles as asked for; zeros where that many are not there.
std::vector<double> doubles(const JsonValue& in, size_t count) {
    std::vector<double> values;
    for (const JsonValue& item : in.items(count, count))
        values.push_back(from_bits(item));
    values.resize(count);
    return values;
}

std::vector<std::string> texts(const JsonValue& in) {
    std::vector<std::string> all;
    for (const JsonValue& item : list(in))
        all.push_back(item.text());
    return all;
}

DicomParts parts_from(const JsonValue& in) {
    DicomParts parts;
    parts.study_uid = in.at("study").text();
    parts.series_uid = in.at("series").text();
    parts.frame_of_reference_uid = in.at("frame_of_reference").text();
    for (const JsonValue& entry : list(in.at("attributes")))
        parts.attributes.push_back(
            {entry.at("tag").whole_number(0, ~0u), entry.at("value").text()});
    for (const JsonValue& entry : list(in.at("slices")))
        parts.slices.push_back({entry.at("class").text(), entry.at("instance").text(),
                                entry.at("frame").whole_number(0, ~0u)});
    return parts;
}

Json parts_json(const DicomParts& parts) {
    Json attributes = Json::array(), slices = Json::array();
    for (const DicomAttribute& attribute : parts.attributes)
        attributes.push_back(Json{{"tag", attribute.tag}, {"value", attribute.value}});
    for (const DicomSlice& slice : parts.slices)
        slices.push_back(Json{
            {"class", slice.class_uid}, {"instance", slice.instance_uid}, {"frame", slice.frame}});
    return Json{{"study", parts.study_uid},
                {"series", parts.series_uid},
                {"frame_of_reference", parts.frame_of_reference_uid},
                {"attributes", attributes},
                {"slices", slices}};
}

Decoded decoded_from(const JsonValue& in) {
    Decoded decoded;
    decoded.grid.size = size_from(in.at("size"));
    const std::vector<double> matrix = doubles(in.at("world_from_index"), 16);
    for (int i = 0; i < 16; ++i)
        decoded.grid.world_from_index[i % 4][i / 4] = matrix[static_cast<size_t>(i)];
    for (const JsonValue& entry : list(in.at("rescale"))) {
        const std::vector<double> both = doubles(entry, 2);
        decoded.rescale.push_back({both[0], both[1]});
    }
    for (const JsonValue& entry : list(in.at("padding"))) {
        const std::vector<double> both = doubles(entry, 2);
        decoded.padding.push_back({both[0], both[1]});
    }
    decoded.inverted = in.at("inverted").boolean();
    decoded.modality = in.at("modality").text();
    decoded.warnings = texts(in.at("warnings"));
    decoded.notes = texts(in.at("notes"));
    for (const JsonValue& entry : list(in.at("series"))) {
        SeriesInfo& series = decoded.series.emplace_back();
        series.number = entry.at("number").whole_number(1, ~0u);
        series.count = entry.at("count").whole_number(1, ~0u);
        series.modality = entry.at("modality").text();
        series.description = entry.at("description").text();
        series.content = entry.at("content").text();
        series.uid = entry.at("uid").text();
        series.is_read = entry.at("is_read").boolean();
    }
    for (const JsonValue& entry : list(in.at("labels"))) {
        LabelName& label = decoded.labels.emplace_back();
        label.label = entry.at("label").whole_number(0, ~0u);
        label.name = entry.at("name").text();
        if (const auto color = entry.find("color")) {
            const std::vector<double> rgb = doubles(*color, 3);
            label.color = glm::dvec3(rgb[0], rgb[1], rgb[2]);
        }
    }
    decoded.frame_of_reference = in.at("frame_of_reference").text();
    if (const auto reference = in.find("reference"))
        decoded.reference = parts_from(*reference);
    return decoded;
}

} // namespace

std::string alive_report(const std::string& file) {
    return json_line({{"at", file}});
}

std::string claim_report(const VoxelClaim& claim) {
    return json_line({{"claim",
                       {{"size", size_json(claim.size)},
                        {"type", static_cast<int>(claim.type)},
                        {"components", claim.components}}}});
}

std::string error_report(const std::string& message) {
    return json_line({{"error", message}});
}

std::string decoded_report(const Decoded& decoded) {
    Json matrix = Json::array();
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            matrix.push_back(bits(decoded.grid.world_from_index[column][row]));
    Json rescale = Json::array();
    for (const Rescale& entry : decoded.rescale)
        rescale.push_back(Json::array({bits(entry.slope), bits(entry.intercept)}));
    Json padding = Json::array();
    for (const StoredRange& entry : decoded.padding)
        padding.push_back(Json::array({bits(entry.low), bits(entry.high)}));
    Json all_series = Json::array();
    for (const SeriesInfo& series : decoded.series)
        all_series.push_back(Json{{"number", series.number},
                                  {"count", series.count},
                                  {"modality", series.modality},
                                  {"description", series.description},
                                  {"content", series.content},
                                  {"uid", series.uid},
                                  {"is_read", series.is_read}});
    Json labels = Json::array();
    for (const LabelName& label : decoded.labels) {
        Json entry{{"label", label.label}, {"name", label.name}};
        if (label.color)
            entry["color"] = {bits(label.color->x), bits(label.color->y), bits(label.color->z)};
        labels.push_back(std::move(entry));
    }
    Json all{{"size", size_json(decoded.grid.size)},
             {"world_from_index", matrix},
             {"rescale", rescale},
             {"padding", padding},
             {"inverted", decoded.inverted},
             {"modality", decoded.modality},
             {"warnings", decoded.warnings},
             {"notes", decoded.notes},
             {"series", all_series},
             {"labels", labels},
             {"frame_of_reference", decoded.frame_of_reference}};
    if (decoded.reference)
        all["reference"] = parts_json(*decoded.reference);
    return json_line({{"decoded", all}});
}

void write_report(int fd, const std::string& line) {
    if (fd < 0)
        return;
    const std::string text = line + "\n";
    for (size_t done = 0; done < text.size();) {
        const ssize_t written = ::write(fd, text.data() + done, text.size() - done);
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            ::_exit(1); // nobody listens any more
        done += static_cast<size_t>(written);
    }
}

Result<void> take_report(const std::string& line, Reported& reported) {
    PALPATE_TRY(const Json json, parse_json(line, "report"));
    JsonErrors errors{"report", {}};
    const JsonValue in(json, "", errors);
    in.only_keys({"claim", "at", "decoded", "error"});
    if (const auto claim = in.find("claim")) {
        constexpr auto last = static_cast<uint32_t>(ComponentType::f64);
        VoxelClaim& to = reported.claim.emplace();
        to.size = size_from(claim->at("size"));
        to.type = static_cast<ComponentType>(claim->at("type").whole_number(0, last));
        to.components = claim->at("components").whole_number(0, ~0u);
    }
    in.take("at", reported.at);
    if (const auto decoded = in.find("decoded"))
        reported.decoded = decoded_from(*decoded);
    if (const auto error = in.find("error"))
        reported.error = error->text();
    if (errors.first)
        return tl::unexpected(*errors.first);
    return {};
}

} // namespace palpate::io
