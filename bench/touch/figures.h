#pragma once

#include <array>
#include <cstdint>

#include "bench/touch/scenes.h"

namespace palpate::touch {

// A histogram that needs no memory of its own: equal bins from 0, the last one open.
class Histogram {
 public:
    explicit Histogram(double bin) : bin_(bin) {}
    void add(double value);
    void add(const Histogram& other); // of the same bin
    // The least upper edge of a bin that at least `share` of all lie below; 0 where there are none.
    double percentile(double share) const;
    uint64_t above(double edge) const; // of a bin
    uint64_t count() const { return count_; }
    double max() const { return max_; }

 private:
    double bin_, max_ = 0.0;
    uint64_t count_ = 0;
    std::array<uint32_t, 2000> bins_{};
};

// Figures of one algorithm on one path in one scene, judged against the body's closed form.
struct Figures {
    uint64_t ticks = 0, contact_ticks = 0;
    uint64_t pop_throughs = 0; // the proxy changed parts of free space, or sank 1.5 voxels
    uint64_t not_finite = 0;   // of force, proxy or normal
    uint64_t behind_ticks = 0; // that say that the proxy has not followed: no direction is judged
    double penetration_voxels = 0.0;  // deepest proxy
    Histogram direction_deg{0.05};    // angle to the true force, where deeper than 0.2 mm
    Histogram magnitude_share{0.001}; // |force| beside k * depth, where deeper than 1 mm
    double excess_jump_n = 0.0;       // see below
    double edit_jump_n = 0.0;         // the same, in ticks that saw something else than before
    double free_force_n = 0.0;        // a voxel and more off a convex free space: must be 0
    double closed_form_n = 0.0;       // distance to the force of the scene's closed form
    double beyond_spring_n = 0.0;     // force beyond stiffness times distance to the proxy
    double largest_force_n = 0.0;
    double energy_mj = 0.0;  // work done on the hand; > 0 is generated
    uint64_t worst_tick = 0; // of the excess jump
    uint64_t force_bits = 0; // a hash of every force: the same run gives the same
    Histogram cpu_us{0.1};   // of a tick, thread clock; only where timed
};

// Follows one run tick by tick. An excess jump is max(0, |dF| - k |dx| expansion(depth)): what the
// force changes beyond what a true projection could. Once the proxy has left the scene's volume, by
// going round the material, nothing of place is judged until tool and proxy are free again. After
// an edit place and direction are not judged while what it moved is bled off: for 0.1 s, and longer
// where the hand is deep.
class Judge {
 public:
    // The tool is a ball of tool_radius_mm, or a point.
    Judge(const Scene& scene, double stiffness_n_per_m, bool judge_jumps,
          bool judge_direction = true, double tool_radius_mm = 0.0);
    // The next tick sees this body in place of the one before. It must outlive the judge.
    void exchange(const Solid& solid);
    void see(glm::dvec3 tool_mm, const haptics::TickOutput& output);
    void seen_cpu(double us) { figures_.cpu_us.add(us); }
    const Figures& figures() const { return figures_; }

 private:
    void see_place(glm::dvec3 proxy, double sunk_voxels);
    void see_direction(glm::dvec3 tool, glm::dvec3 force, double depth_mm);
    void see_change(glm::dvec3 tool, glm::dvec3 force, double depth_mm);

    const Scene& scene_;
    Solid solid_;
    double stiffness_, tool_radius_mm_;
    bool judge_jumps_, judge_direction_;
    Figures figures_;
    bool has_last_ = false, has_proxy_ = false;
    glm::dvec3 last_tool_{}, last_force_{}, last_proxy_{};
    uint64_t since_exchange_ = ~uint64_t{0} >> 1; // ticks
    uint64_t settled_after_ = 0;                  // the jump of an exchange is bled off by then
    int part_ = 0;
    bool sunk_ = false;
    bool is_blind_ = false;
};

} // namespace palpate::touch
