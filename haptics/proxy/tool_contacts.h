#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <optional>
#include <span>

#include "haptics/field/algorithm.h"
#include "haptics/field/field.h"
#include "haptics/field/sphere_samples.h"
#include "haptics/proxy/feel.h"
#include "haptics/proxy/tool_hold.h"
#include "haptics/proxy/tool_points.h"

namespace palpate::haptics {

// The samples of a tool, and where they touch the field at a place: the geometry of swept-tool
// (swept_tool.h). A place in material or nearly so is a contact: its clearance is (iso - value) /
// slope along the smoothed normal there. Of contacts that face the same way the deepest is kept.
class ToolContacts {
 public:
    static constexpr uint32_t kMost = 24;   // contacts
    static constexpr double kFacing = 0.96; // cosine of 16 degrees: its plane is that of a ball
    // Tenths of a microsecond that a tick may spend: half of the 200 us that a tick of 1 ms may
    // take, for a machine half as fast as the one that tool_contacts.cpp was measured on.
    static constexpr uint32_t kMostWork = 1000;

    // At the start of a tick. `volume` must live until its end.
    void follow(const TickInput& input, const Volume& volume);

    // Looks at the tool at a place: at the places in `held`, at that of a ball which is pushed on
    // to goal_mm, and with `all` at the deepest of all samples.
    struct Asked {
        std::span<const Touch> held;
        glm::dvec3 goal_mm{0.0};
        bool all = true;
    };
    void find(glm::dvec3 at_mm, const Asked& asked);
    // Whether the work that a tick may do is done. A look that was begun does not stop for that,
    // but for samples in material that are shallower than those it has considered.
    bool is_spent() const { return work() > kMostWork; }

    // The result of the last find(); without `all` nothing is known of the samples but the held
    // ones, and the first four are false. A place is flat that has no slope or is buried.
    struct Look {
        bool any_inside = false;                   // samples are in material
        bool any_flat = false, any_sloped = false; // among those of them that were considered
        bool is_spent = false;                     // the work of a tick; some were not considered
    };
    const Look& look() const { return look_; }
    std::span<const Hold> holds() const { return {holds_.data(), count_}; }
    void add(const Hold& hold); // where there is room
    bool is_deep() const;       // one of them, farther in material than noise tells
    bool is_sunk() const;       // one of them, by half a sample or more
    // How far off a place that holds the tool may be taken to be.
    double doubt_mm() const;
    // How far points of the tool have moved about its origin since the tick before: it turned or
    // grew. Infinite where it is another.
    double reshaped_mm() const { return reshaped_mm_; }
    double reach_mm() const { return reach_mm_; } // of its farthest point from its origin
    // Another number where what a tool at that place feels may have changed.
    uint64_t stamps_about(glm::dvec3 at_mm) const {
        return field_.stamps_about(at_mm, reach_samples_);
    }

    // Whether no sample is in material there, or none deeper than at `other_mm`, by more than bumps
    // are.
    bool is_as_free(glm::dvec3 at_mm, glm::dvec3 other_mm);
    // Whether no sample is in material there; whether there is nothing on the way, at a glance.
    bool is_free(glm::dvec3 at_mm);
    bool is_clear(glm::dvec3 from_mm, glm::dvec3 to_mm);

    bool has(const Touch& touch) const { return touch.sample < point_count_; }
    // From the tool's origin, mm, world axes.
    glm::dvec3 arm_of(const Touch& touch) const {
        return is_ball_ ? reach_mm_ * touch.way : points_[touch.sample];
    }
    const Field& field() const { return field_; }
    // Whether the contacts that push it there are made of samples without data or not in memory;
    // where none does, whether some of its points are, or what held it before.
    bool lacks_data(glm::dvec3 at_mm, glm::dvec3 push_mm, std::span<const Touch> held) const;
    // The feel of what the tool touches at a place: at the contacts of the last find() that push it
    // along push_mm; where there are none, at its samples in material or nearly so. None where
    // nothing is touched.
    std::optional<Feel> feel_at(glm::dvec3 at_mm, glm::dvec3 push_mm, const TouchParameters& q);

 private:
    void place_points(const TickInput& input);
    double deepest_mm() const;
    std::span<const uint16_t> near_points(glm::dvec3 at);
    uint32_t solid_points(glm::dvec3 at);
    float deepest_value(glm::dvec3 at);
    void consider_deepest(glm::dvec3 at);
    enum class Turn { stays, faces };
    bool consider(glm::dvec3 at, Touch touch, Turn turn = Turn::faces); // false: it has no slope
    void look_where_pushed(glm::dvec3 at, glm::dvec3 pushed);
    bool is_beside_pushed(glm::dvec3 way) const;
    Field::Both felt_at(glm::dvec3 at);
    double least_slope() const; // value units per mm: below it a place is flat
    double clearance_of(const FieldSample& sharp, double slope, glm::dvec3 normal) const;
    bool is_held_where_pushed() const { return is_ball_ && !is_labels_; }
    void face(Hold& found) const;
    double left_mm(const Hold& hold, glm::dvec3 at) const {
        return hold.clearance_mm + glm::dot(hold.normal, at - found_at_);
    }
    void keep(const Hold& found);
    Touch touch_of(uint32_t sample) const {
        return {sample, is_ball_ ? points_[sample] / reach_mm_ : glm::dvec3(0.0)};
    }
    uint32_t work() const;

    Field field_;
    double noise_samples_ = 0.0; // of normals' blur, against noise
    double blur_samples_ = 0.0;  // likewise, and of edge and normals on grey values
    bool is_labels_ = false;

    uint32_t point_count_ = 0;
    double reach_mm_ = 0.0; // of the farthest point
    double reshaped_mm_ = 0.0;
    bool is_ball_ = false;
    double beside_pushed_ = 1.0; // of a ball: the cosine of kBesidePushed_samples
    double cover_ = 0.0;         // of a ball: the cosine of how far from its samples places lie
    SphereSamples sphere_;
    std::array<glm::dvec3, SphereSamples::kMost> points_; // about the tool's origin, world axes
    std::array<glm::vec3, SphereSamples::kMost> offsets_; // the same in index space
    double reach_samples_ = 0.0;                          // of the farthest offset, on any axis
    // Inputs of points_.
    const ToolPoints* made_of_ = nullptr;
    uint64_t made_in_version_ = 0, made_in_settings_ = 0;
    glm::dquat made_turn_{0.0, 0.0, 0.0, 0.0};
    double made_radius_mm_ = -1.0;
    uint32_t made_samples_ = 0;
    // The points that may be in material while the tool is within a sample of near_at_.
    uint32_t near_count_ = 0;
    uint64_t near_samples_ = 0; // of Field::samples_about
    glm::dvec3 near_at_{0.0};
    std::array<uint16_t, SphereSamples::kMost> near_;
    std::array<Field::Inside, SphereSamples::kMost> inside_;

    uint32_t count_ = 0;
    std::array<Hold, kMost> holds_; // one that is_pushed comes first
    glm::dvec3 found_at_{0.0};      // where find() looked for them
    Look look_;
    uint32_t considered_ = 0, scanned_ = 0, leaps_ = 0; // in this tick
};

} // namespace palpate::haptics
