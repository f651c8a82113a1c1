#pragma once

#include <memory>
#include <vector>

#include "engine/image/image.h"
#include "engine/render/renderer.h"
#include "engine/scene/scene.h"

namespace palpate::cases {

// Choices of a renderer that must not change a picture.
struct Choices {
    TexelFormat volume_format = TexelFormat::automatic;
    bool skipping = true; // jump over empty space
    Residency residency = Residency::automatic;
    Sampling sampling = Sampling::device;

    friend bool operator==(const Choices&, const Choices&) = default;
};

// The renderer of a hard case's scenes.
class Painter {
 public:
    virtual ~Painter() = default;
    // The mono or left eye's picture. Throws std::runtime_error where it cannot be drawn.
    virtual Image draw(const Scene& scene, const SceneData& data, const Choices& choices = {}) = 0;
    // How far a weight of trilinear interpolation may be from its exact value on one axis: 0 where
    // it is computed in fp32 or better, 2^-9 for samplers with 8 fractional bits.
    virtual double weight_rounding() const = 0;
};

// The renderer on a device, which must outlive it. One renderer is kept for each set of choices.
class GpuPainter : public Painter {
 public:
    explicit GpuPainter(GpuDevice& device) : device_(device) {}
    Image draw(const Scene& scene, const SceneData& data, const Choices& choices) override;
    double weight_rounding() const override;

 private:
    GpuDevice& device_;
    std::vector<std::pair<Choices, std::unique_ptr<Renderer>>> renderers_;
};

// The fp64 twin, for which there are no choices.
class TwinPainter : public Painter {
 public:
    Image draw(const Scene& scene, const SceneData& data, const Choices& choices) override;
    double weight_rounding() const override { return 0.0; }
};

} // namespace palpate::cases
