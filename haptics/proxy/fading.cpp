#include "haptics/proxy/fading.h"

#include "haptics/field/coupling.h"
#include "haptics/field/samples.h"
#include "haptics/proxy/effects.h"
#include "haptics/proxy/yielding.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

constexpr double kReturning_s = 0.1;
// Samples that an interpolated gradient or a cell of marching cubes reads
// beyond a place.
constexpr int kGradientReach = 2;

bool lacks_data_at(const std::optional<Volume>& volume, dvec3 world_mm) {
    if (!volume)
        return false;
    const glm::ivec3 cell(glm::floor(glm::clamp(index_point(volume->grid(), world_mm), -1e6, 1e6)));
    return lacks_data(*volume, cell - kGradientReach, cell + 1 + kGradientReach);
}

class Fading final : public Algorithm {
 public:
    Fading(std::unique_ptr<Algorithm> algorithm, Reads reads)
        : algorithm_(std::move(algorithm)), reads_(reads) {}
    void reset(const TickInput& input) noexcept override {
        algorithm_->reset(input);
        felt_n_ = normal_ = dvec3(0.0);
        tool_ = input.tool.position_mm;
        bleed_.forget();
        lacked_data_ = false;
        catching_up_s_ = 0.0;
    }
    TickOutput tick(const TickInput& input) noexcept override;
    std::vector<std::span<const std::byte>> memory() const override {
        auto all = algorithm_->memory();
        all.push_back(std::as_bytes(std::span(this, 1)));
        return all;
    }

 private:
    bool lacks_data_about(const TickInput& input, const TickOutput& output) const;

    std::unique_ptr<Algorithm> algorithm_;
    Reads reads_;
    dvec3 felt_n_{0.0}, normal_{0.0}, tool_{0.0}; // of the last tick
    Bleed bleed_;                                 // of force, N
    bool lacked_data_ = false;
    double catching_up_s_ = 0.0;
};

bool Fading::lacks_data_about(const TickInput& input, const TickOutput& output) const {
    if (reads_ == Reads::nothing)
        return output.contact == Contact::unknown;
    const TouchScene& scene = *input.scene;
    const bool labels = reads_ == Reads::source && input.parameters->source == TouchSource::labels;
    const std::optional<Volume>& volume = labels ? scene.labels : scene.grey;
    const dvec3 x = input.tool.position_mm, proxy = output.proxy.position_mm;
    const double radius_mm = input.parameters->tool_radius_mm;
    for (const dvec3 place :
         {x, proxy, proxy - radius_mm * output.normal, proxy - radius_mm * normal_}) {
        if (lacks_data_at(volume, place))
            return true;
        if (reads_ == Reads::grey_and_field)
            for (const std::optional<Volume>& part : scene.field)
                if (lacks_data_at(part, place))
                    return true;
    }
    return false;
}

TickOutput Fading::tick(const TickInput& input) noexcept {
    TickOutput output = algorithm_->tick(input);
    const dvec3 x = input.tool.position_mm;
    if (!is_sane(input)) {
        felt_n_ = dvec3(0.0);
        bleed_.forget();
        return output;
    }
    const bool lacks = lacks_data_about(input, output);
    if (lacks) {
        algorithm_->reset(input);
        output = unknown_output(x);
        output.proxy = input.tool;
        bleed_.take_up(felt_n_, dvec3(0.0), 0.0);
    } else {
        catching_up_s_ = lacked_data_ ? kReturning_s : catching_up_s_ - input.dt_s;
        if (catching_up_s_ > 0.0)
            bleed_.take_up(felt_n_, output.force_n,
                           1e-3 * input.parameters->stiffness_n_per_m * glm::distance(x, tool_));
    }
    if (!bleed_.is_over())
        output.force_n += bleed_.next(Yielding::kRate_n_per_s, input.dt_s);
    lacked_data_ = lacks;
    felt_n_ = output.force_n;
    normal_ = output.normal != dvec3(0.0) || lacks ? output.normal : normal_;
    tool_ = x;
    return output;
}

} // namespace

std::unique_ptr<Algorithm> with_fading(std::unique_ptr<Algorithm> algorithm, Reads reads) {
    return std::make_unique<Fading>(std::move(algorithm), reads);
}

} // namespace palpate::haptics
