#pragma once

#include "bench/suite/conversation.h"
#include "bench/suite/measure.h"
#include "engine/mesh/mesh.h"

namespace palpate::bench {

// VTK's and scikit-image's surfaces, standing by in bench/peers_surface.py: asked between our own
// runs, so that a machine that grows slower grows slower for both. What goes wrong on the way to
// them is no failure: absent_because() says it, and they say no more from then on.
class SurfacePeers {
 public:
    explicit SurfacePeers(const Options& options);

    // Hands a volume over: the surface of `iso`, or, where there are `labels`, of each of those.
    // With `few` only flying edges are asked, as the others would take minutes. Returns the names
    // of who can be timed; none where they are absent.
    std::vector<std::string> open(const Sample& sample, double iso,
                                  const std::vector<double>& labels, bool few);

    // One extraction of the open volume; ms, or nothing where they fell silent.
    std::optional<double> run(const std::string& who);

    // The result of the last run of `who`. The mesh is empty unless asked for.
    struct Made {
        uint64_t triangles = 0;
        Mesh mesh;
    };
    std::optional<Made> made(const std::string& who, bool with_mesh);

    // Flying edges on the open volume with a ball taken out, as eroded() of surface_edits.cpp does.
    struct Dab {
        double ms = 0.0;
        uint64_t triangles = 0;
    };
    std::optional<Dab> dab(glm::dvec3 centre, double radius, double slope);

    const std::string& absent_because() const { return absent_because_; } // a sentence
    const Json& versions() const { return versions_; }                    // {vtk, skimage}

 private:
    std::optional<Json> ask(const Json& question);

    fs::path out_;
    std::optional<Conversation> vtk_;
    std::string absent_because_;
    Json versions_ = Json::object();
};

} // namespace palpate::bench
