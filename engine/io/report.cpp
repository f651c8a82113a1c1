#include "engine/io/report.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

namespace palpate::io {

using Json = nlohmann::json;

namespace {

// Doubles travel as their bits: NaN and infinities have no JSON.
Json bits(double value) {
    uint64_t word;
    std::memcpy(&word, &value, sizeof word);
    return word;
}

double from_bits(const Json& json) {
    const uint64_t word = json.get<uint64_t>();
    double value;
    std::memcpy(&value, &word, sizeof value);
    return value;
}

Json size_json(glm::uvec3 size) {
    return {size.x, size.y, size.z};
}

glm::uvec3 size_from(const Json& json) {
    return {json.at(0).get<uint32_t>(), json.at(1).get<uint32_t>(), json.at(2).get<uint32_t>()};
}

std::string dumped(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace); // headers hold any bytes
}

Decoded decoded_from(const Json& json) {
    Decoded decoded;
    decoded.grid.size = size_from(json.at("size"));
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            decoded.grid.world_from_index[column][row] =
                from_bits(json.at("world_from_index").at(4 * row + column));
    for (const Json& entry : json.at("rescale"))
        decoded.rescale.push_back({from_bits(entry.at(0)), from_bits(entry.at(1))});
    decoded.modality = json.at("modality").get<std::string>();
    decoded.warnings = json.at("warnings").get<std::vector<std::string>>();
    decoded.notes = json.at("notes").get<std::vector<std::string>>();
    for (const Json& entry : json.at("labels")) {
        LabelName& label = decoded.labels.emplace_back();
        label.label = entry.at("label").get<uint32_t>();
        label.name = entry.at("name").get<std::string>();
        if (const Json& color = entry.at("color"); !color.is_null())
            label.color =
                glm::dvec3(from_bits(color.at(0)), from_bits(color.at(1)), from_bits(color.at(2)));
    }
    return decoded;
}

} // namespace

std::string alive_report(const std::string& file) {
    return dumped({{"at", file}});
}

std::string claim_report(const VoxelClaim& claim) {
    return dumped({{"claim",
                    {{"size", size_json(claim.size)},
                     {"type", static_cast<int>(claim.type)},
                     {"components", claim.components}}}});
}

std::string error_report(const std::string& message) {
    return dumped({{"error", message}});
}

std::string decoded_report(const Decoded& decoded) {
    Json matrix = Json::array();
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            matrix.push_back(bits(decoded.grid.world_from_index[column][row]));
    Json rescale = Json::array();
    for (const Rescale& entry : decoded.rescale)
        rescale.push_back({bits(entry.slope), bits(entry.intercept)});
    Json labels = Json::array();
    for (const LabelName& label : decoded.labels) {
        Json color;
        if (label.color)
            color = {bits(label.color->x), bits(label.color->y), bits(label.color->z)};
        labels.push_back({{"label", label.label}, {"name", label.name}, {"color", color}});
    }
    return dumped({{"decoded",
                    {{"size", size_json(decoded.grid.size)},
                     {"world_from_index", matrix},
                     {"rescale", rescale},
                     {"modality", decoded.modality},
                     {"warnings", decoded.warnings},
                     {"notes", decoded.notes},
                     {"labels", labels}}}});
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
    try {
        const Json json = Json::parse(line);
        if (json.contains("claim")) {
            const Json& claim = json.at("claim");
            const int type = claim.at("type").get<int>();
            if (type < 0 || type > static_cast<int>(ComponentType::f64))
                return fail("type {} is unknown", type);
            VoxelClaim& to = reported.claim.emplace();
            to.size = size_from(claim.at("size"));
            to.type = static_cast<ComponentType>(type);
            to.components = claim.at("components").get<uint32_t>();
        }
        if (json.contains("at"))
            reported.at = json.at("at").get<std::string>();
        if (json.contains("decoded"))
            reported.decoded = decoded_from(json.at("decoded"));
        if (json.contains("error"))
            reported.error = json.at("error").get<std::string>();
        return {};
    } catch (const Json::exception& error) {
        return fail("{}", error.what());
    }
}

} // namespace palpate::io
