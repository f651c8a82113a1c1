#pragma once

#include <map>
#include <string>
#include <vector>

#include "engine/net/net_server.h"
#include "engine/volume/volume.h"

// MONAI Label's protocol: GET /info/, PUT /session/, POST /infer/MODEL, DELETE /session/ID.
namespace palpate {

struct MonaiModel {
    std::string name;
    std::string type;                       // "segmentation", "deepedit", "deepgrow", ..
    std::map<std::string, uint16_t> labels; // their numbers in the result, by name
    std::string license;                    // where the server states one; else ""

    // deepgrow and deepedit are shown places; others take the image alone.
    bool takes_points() const { return type == "deepgrow" || type == "deepedit"; }
};

// The models of a server, by name. No sample is sent.
Result<std::vector<MonaiModel>> monai_models(const NetServer& server, const std::stop_token& stop);

// Places that a person has shown, in samples.
struct MonaiPoints {
    std::vector<glm::uvec3> inside, outside;
};

// Sends a volume as .nii.gz, in a session that is closed afterwards where the server has sessions,
// asks for the model's labels, once for each entry of `points` and once without points where there
// is none, and returns label maps on the volume's grid, in the order of `points`. Answers are read
// by the child that decodes foreign files; those on another grid are refused.
Result<std::vector<Volume>> monai_infer(const NetServer& server, const MonaiModel& model,
                                        const Volume& volume,
                                        const std::map<uint16_t, MonaiPoints>& points,
                                        const std::stop_token& stop);

} // namespace palpate
