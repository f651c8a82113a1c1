#include "bench/study/liver_phantom.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/segment/draw.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate::bench {

namespace {

// Shapes give mm to their surface, positive inside; only near it are they exact, where edges are.

struct Ellipsoid {
    glm::dvec3 center_mm, radii_mm;

    double depth_mm(glm::dvec3 p) const {
        const glm::dvec3 q = (p - center_mm) / radii_mm;
        const double r = glm::length(q);
        const double slope = glm::length(q / radii_mm); // of r, times r
        return slope > 0.0 ? (1.0 - r) * r / slope : std::min({radii_mm.x, radii_mm.y, radii_mm.z});
    }
};

struct Tube {
    glm::dvec3 from_mm, to_mm;
    double radius_mm;

    double depth_mm(glm::dvec3 p) const {
        const glm::dvec3 along = to_mm - from_mm;
        const double t =
            std::clamp(glm::dot(p - from_mm, along) / glm::dot(along, along), 0.0, 1.0);
        return radius_mm - glm::distance(p, from_mm + t * along);
    }
};

// The greater of both, rounded over `width` mm where they are near each other.
double join(double a, double b, double width) {
    const double h = std::max(width - std::abs(a - b), 0.0) / width;
    return std::max(a, b) + h * h * width / 4.0;
}

struct Wave {
    glm::dvec3 direction, per_mm;
    double phase = 0.0;
};

// All that is drawn for one abdomen.
class Abdomen {
 public:
    explicit Abdomen(uint64_t number) : draw_(0x6c69766572u + 7919 * number) {
        const double wide_mm = draw_.between(2.0, 3.0), thick_mm = draw_.between(2.0, 5.0);
        const glm::dvec3 spacing(wide_mm, wide_mm, thick_mm), low(-165.0, -120.0, -115.0);
        grid_ = make_grid(glm::uvec3(2.0 * glm::abs(low) / spacing) + 1u, spacing, low);
        edge_mm_ = std::max(wide_mm, thick_mm);

        liver_hu_ = draw_.between(95.0, 125.0);
        contrast_hu_ = draw_.between(25.0, 60.0);
        noise_hu_ = contrast_hu_ / draw_.between(1.5, 4.0);
        heart_hu_ = liver_hu_ + draw_.between(-5.0, 25.0);
        // Half of them leak.
        bridge_mm_ = draw_.between(0.0, 1.0) < 0.5 ? draw_.between(6.0, 16.0) : 0.0;

        for (Wave& wave : waves_) {
            wave.direction = draw_.within(1.0) * 6.0; // mm
            const glm::dvec3 towards = draw_.within(1.0) + glm::dvec3(0.0, 0.0, 1e-3);
            wave.per_mm =
                glm::normalize(towards) * 2.0 * std::numbers::pi / draw_.between(90.0, 220.0);
            wave.phase = draw_.between(0.0, 2.0 * std::numbers::pi);
        }
        const double size = draw_.between(0.88, 1.08);
        const auto organ = [&](glm::dvec3 center, glm::dvec3 radii) {
            return Ellipsoid{center + draw_.within(6.0), radii * draw_.between(0.92, 1.08)};
        };
        right_lobe_ = organ({-78, 0, 5}, glm::dvec3(64, 72, 78) * size);
        left_lobe_ = organ({-5, -42, 30}, glm::dvec3(72, 36, 34) * size);
        caudate_ = organ({-25, 12, 18}, glm::dvec3(26, 26, 30) * size);
        heart_ = organ({28, -40, 96}, {52, 46, 40});
        spleen_ = organ({112, 38, 30}, {30, 42, 50});
        stomach_ = organ({78, -28, 5}, {40, 42, 52});
        kidney_ = organ({-58, 62, -70}, {28, 26, 54});
        gall_bladder_ = organ({-52, -52, -48}, {17, 24, 34});
        lungs_ = {organ({-85, 10, 135}, {66, 80, 90}), organ({90, 15, 135}, {62, 80, 90})};
        bowel_ = {organ({25, -45, -75}, {60, 40, 34}), organ({-35, -20, -100}, {50, 45, 26})};
        cava_ = {{-22, 38, -150}, {-18, 34, 150}, draw_.between(9.0, 13.0)};
        aorta_ = {{14, 48, -150}, {10, 52, 150}, draw_.between(9.0, 12.0)};
        grow_vessels();
        const int lesions = static_cast<int>(draw_.between(0.0, 3.999));
        for (int i = 0; i < lesions; ++i)
            lesions_.push_back(
                {right_lobe_.center_mm + draw_.within(35.0), glm::dvec3(draw_.between(6.0, 16.0))});
    }

    const Grid& grid() const { return grid_; }
    double contrast_hu() const { return contrast_hu_; }
    double noise_hu() const { return noise_hu_; }
    double bridge_mm() const { return bridge_mm_; }

    struct Point {
        double hu = 0.0, liver_mm = 0.0; // positive inside
    };
    Point at(glm::dvec3 world_mm) const {
        glm::dvec3 p = world_mm;
        for (const Wave& wave : waves_)
            p += wave.direction * (std::sin(glm::dot(wave.per_mm, world_mm) + wave.phase) / 6.0);

        double hu = -1000.0;
        const auto lay = [&](double depth_mm, double value_hu) { // over what lies there
            hu += (value_hu - hu) * std::clamp(depth_mm / edge_mm_ + 0.5, 0.0, 1.0);
        };
        const double wall_hu = liver_hu_ - contrast_hu_;
        const auto body_mm = [&](double skin_mm) { // a cylinder, so much below the skin
            return Ellipsoid{{0, 0, p.z}, {158 - skin_mm, 112 - skin_mm, 1e4}}.depth_mm(p);
        };
        lay(body_mm(0.0), -100.0);
        lay(body_mm(9.0), wall_hu);
        const double rib = std::abs(std::remainder(p.z + 0.5 * std::abs(p.x), 28.0));
        lay(std::min({body_mm(11.0), -body_mm(18.0), 5.0 - rib}), 420.0);
        lay(body_mm(21.0), -95.0);
        lay(Tube{{0, 82, -200}, {0, 82, 200}, 21.0}.depth_mm(p), 230.0);
        for (const Ellipsoid& one : bowel_)
            lay(one.depth_mm(p), 35.0);
        lay(stomach_.depth_mm(p), 25.0);
        const double inner_mm = body_mm(21.0);
        lay(std::min(spleen_.depth_mm(p), inner_mm), liver_hu_ + 8.0);
        for (const Ellipsoid& lung : lungs_)
            lay(std::min(lung.depth_mm(p), inner_mm), -850.0);
        lay(heart_.depth_mm(p), heart_hu_);
        lay(aorta_.depth_mm(p), liver_hu_ + 45.0);

        const double kidney_mm = kidney_.depth_mm(p), gall_mm = gall_bladder_.depth_mm(p),
                     cava_mm = cava_.depth_mm(p);
        double liver_mm = join(right_lobe_.depth_mm(p), left_lobe_.depth_mm(p), 30.0);
        liver_mm = join(liver_mm, caudate_.depth_mm(p), 20.0);
        // It ends at the wall, before the heart, and at the organs that press into it.
        const double fat_mm = bridge_mm_ > 0.0 ? 0.0 : 4.0;
        liver_mm =
            std::min({liver_mm, inner_mm + 6.0, -heart_.depth_mm(p) - fat_mm, -kidney_mm - 2.0,
                      -gall_mm, -cava_mm, -stomach_.depth_mm(p) - 2.0, -aorta_.depth_mm(p) - 5.0});
        lay(liver_mm, liver_hu_);
        for (const Tube& vessel : vessels_)
            lay(std::min(vessel.depth_mm(p), liver_mm), liver_hu_ + 45.0);
        for (const Ellipsoid& lesion : lesions_)
            lay(std::min(lesion.depth_mm(p), liver_mm), liver_hu_ - 40.0);
        lay(kidney_mm, liver_hu_ + 70.0);
        lay(gall_mm, 8.0);
        lay(cava_mm, liver_hu_ + 30.0);
        if (bridge_mm_ >
            0.0) { // from the left lobe's middle to the heart's, with the liver's value
            const Tube bridge{left_lobe_.center_mm, heart_.center_mm, bridge_mm_};
            lay(bridge.depth_mm(p), liver_hu_);
        }
        return {hu, liver_mm};
    }

 private:
    // A trunk from the caudate lobe, and three generations of two branches each.
    void grow_vessels() {
        struct Tip {
            glm::dvec3 at, towards;
            double radius_mm;
        };
        std::vector<Tip> tips{{caudate_.center_mm, {-0.9, -0.3, 0.1}, 6.0}};
        for (int generation = 0; generation < 3; ++generation) {
            std::vector<Tip> next;
            for (const Tip& tip : tips)
                for (int branch = 0; branch < 2; ++branch) {
                    const glm::dvec3 towards = glm::normalize(tip.towards + draw_.within(0.7));
                    const glm::dvec3 end = tip.at + towards * draw_.between(22.0, 38.0);
                    vessels_.push_back({tip.at, end, tip.radius_mm});
                    next.push_back({end, towards, tip.radius_mm * 0.7});
                }
            tips = std::move(next);
        }
    }

    Draw draw_;
    Grid grid_;
    double edge_mm_ = 0.0, liver_hu_ = 0.0, contrast_hu_ = 0.0, noise_hu_ = 0.0, heart_hu_ = 0.0,
           bridge_mm_ = 0.0;
    std::array<Wave, 6> waves_;
    Ellipsoid right_lobe_, left_lobe_, caudate_, heart_, spleen_, stomach_, kidney_, gall_bladder_;
    std::array<Ellipsoid, 2> lungs_, bowel_;
    Tube cava_, aorta_;
    std::vector<Tube> vessels_;
    std::vector<Ellipsoid> lesions_;
};

// Noise of variance 1: a mean over 2 x 2 samples of a slice.
double smooth_noise(glm::uvec3 index, uint64_t seed) {
    double sum = 0.0;
    for (uint32_t y = 0; y < 2; ++y)
        for (uint32_t x = 0; x < 2; ++x)
            sum += synthetic::noise(index + glm::uvec3(x, y, 0), seed);
    return sum / 2.0;
}

} // namespace

LiverPhantom liver_phantom(uint64_t number) {
    const Abdomen abdomen(number);
    const Grid& grid = abdomen.grid();
    const size_t row = grid.size.x, plane = row * grid.size.y;
    std::vector<int16_t> values(sample_count(grid));
    std::vector<uint8_t> inside(values.size());
    tbb::parallel_for(uint32_t{0}, grid.size.z, [&](uint32_t z) {
        for (uint32_t y = 0; y < grid.size.y; ++y)
            for (uint32_t x = 0; x < grid.size.x; ++x) {
                const glm::uvec3 index(x, y, z);
                const Abdomen::Point point = abdomen.at(world_point(grid, glm::dvec3(index)));
                const double noisy = point.hu + abdomen.noise_hu() * smooth_noise(index, number);
                values[x + row * y + plane * z] = static_cast<int16_t>(std::lround(noisy));
                inside[x + row * y + plane * z] = point.liver_mm > 0.0;
            }
    });
    return {make_volume(grid, std::span<const int16_t>(values)),
            make_volume(grid, std::span<const uint8_t>(inside)), abdomen.contrast_hu(),
            abdomen.noise_hu(), abdomen.bridge_mm()};
}

} // namespace palpate::bench
