#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <queue>
#include <span>
#include <stop_token>
#include <tuple>
#include <vector>

#include "engine/mesh/collapse_source.h"
#include "engine/mesh/near_proof.h"
#include "engine/mesh/quadric.h"

namespace palpate {

// Why edges were left.
struct KeptEdges {
    uint64_t by_distance = 0; // the surface would move too far
    uint64_t by_topology = 0; // a hole, a handle, a component or a line between walls would go
    uint64_t by_shape = 0;    // a triangle would turn over or become a sliver
};

// Collapses the edges of a mesh, one after another, where the surface moves least.
//
// Each collapse replaces an edge by one vertex, at the point of least quadric error, and is made
// only when the surface is known to stay near the original. From the original: every original
// vertex is attached, once for each of its patches, to a triangle of the result; those of the
// triangles about the edge are measured to the triangles that take their place, and then all
// points of the original triangles at those vertices. To the original: the new vertex, and then all
// points of the new triangles (NearProof).
//
// Topology is kept exactly, by the link conditions of Dey, Edelsbrunner, Guha & Nekhayev
// ("Topology preserving edge contraction", 1999): lines where an edge has one triangle, or three
// and more, or two of different patches, remain lines, and their ends and crossings stay in place.
// One thread; the result depends on nothing but the input.
class EdgeCollapse {
 public:
    // Points that are measured lie within the level of the other surface. All others lie within
    // this many levels: the nearer to 1, the longer a proof takes.
    static constexpr double kProof = NearProof::kSlack;

    struct Options {
        double limit_mm = 0.0; // > 0, may be infinite: the level that collapses may reach
        uint64_t least_triangles = 0;
        std::stop_token stop;
        std::function<void(double share)> progress; // called now and then; may be empty
    };
    EdgeCollapse(const CollapseSource& source, Options options);

    void run(); // to its end, or until asked to stop

    uint64_t triangle_count() const { return alive_; }
    // Points of either surface are at most kProof of these from the other. Starts at the limit or,
    // with least_triangles or without a limit, at 1/64 of it, or of the mesh's edges.
    double level_mm() const { return level_; }
    const KeptEdges& kept() const { return kept_; }

    // The triangles that are left, rising; their corners are vertex numbers of the original.
    std::vector<uint32_t> survivors() const;
    glm::uvec3 triangle(uint32_t n) const { return triangles_[n]; }
    glm::vec3 position(uint32_t v) const { return positions_[v]; } // mesh space
    bool has_moved(uint32_t v) const { return moved_[v]; }

 private:
    static constexpr uint32_t kNone = NearProof::kNone;
    using Piece = NearProof::Piece;
    using Found = NearProof::Found;
    enum class Kind : uint8_t { inside, line, fixed };
    enum class Refusal : uint8_t { none, distance, topology, shape };
    struct Entry {
        float key;
        uint32_t a, b, stamp;
        bool operator<(const Entry& e) const { // the queue's top is the least
            return std::tie(key, a, b) > std::tie(e.key, e.a, e.b);
        }
    };
    struct Witness {                   // an original vertex in one of its patches
        uint32_t vertex, next, holder; // the next of those that the same triangle holds
    };
    struct Candidate {
        uint32_t triangle, patch;
        Corners points;
        glm::dvec3 centre; // of a sphere about the points
        double radius;
        Candidate(uint32_t n, uint32_t of_patch, const Corners& corners);
        bool may_be_within(double mm, glm::dvec3 point) const {
            const glm::dvec3 gap = point - centre;
            return glm::dot(gap, gap) < (mm + radius) * (mm + radius);
        }
    };
    struct Changed {
        uint32_t triangle;
        glm::uvec3 corners;
        Corners points;
        uint32_t moved_corner;
        uint32_t near; // original triangle near that corner
    };
    struct Verdict {
        Refusal refusal = Refusal::none;
        double error_mm = 0.0; // at least; above the level where it is refused for distance
    };

    void classify_vertices();
    void add_quadrics();
    void attach_vertices();
    bool is_line_edge(uint32_t a, uint32_t b) const;
    uint32_t other_end(uint32_t v, uint32_t neighbour) const;
    void corners_of(uint32_t v, std::vector<uint32_t>& triangles);
    void push_edges_of(uint32_t v);
    bool push(uint32_t a, uint32_t b); // false where lines forbid it
    void push_all();
    bool run_queue();

    bool place(uint32_t a, uint32_t b); // sets keep_, gone_, point_, position_
    bool keeps_topology();
    bool keeps_shape();
    bool keeps_shape_at_an_end();
    double error_of_attached();
    double error_of_new();
    double error_of_original();
    void gather_originals();
    void gather_candidates();
    static Found nearest_of(const std::vector<Candidate>& candidates, glm::dvec3 point,
                            uint32_t patch, Found found);
    bool is_dying(uint32_t n) const;
    Corners original(uint32_t n) const;
    Corners current(uint32_t n) const; // as if the edge had collapsed
    Found nearest_original(glm::dvec3 point, uint32_t patch, std::span<const uint32_t> hints) const;
    Verdict judge(uint32_t a, uint32_t b);
    void collapse();

    const CollapseSource& source_;
    Options options_;
    glm::dmat3 linear_, inverse_;
    glm::dvec3 offset_;
    std::vector<glm::dvec3> points_;
    std::vector<glm::vec3> positions_;
    std::vector<glm::uvec3> triangles_; // x is kNone where it is gone
    std::vector<char> moved_;
    std::vector<Kind> kind_;
    std::vector<std::array<uint32_t, 2>> line_; // neighbours along its line, of a line's vertex
    std::vector<Quadric> quadrics_;
    std::vector<uint32_t> stamp_; // counts changes; kNone where a vertex is gone
    std::vector<uint32_t> first_corner_, next_corner_; // 3 n + i: lists of corners at a vertex
    std::vector<Witness> witnesses_;
    std::vector<uint32_t> first_witness_;     // of a triangle
    std::vector<uint32_t> witness_of_corner_; // 3 n + i of the original
    std::vector<uint32_t> near_;              // original triangle near corner 3 n + i
    std::priority_queue<Entry> queue_;
    uint64_t alive_ = 0;
    double level_ = 0.0;
    KeptEdges kept_;

    // The state of the edge that is looked at.
    uint32_t keep_ = 0, gone_ = 0;
    glm::dvec3 point_{};
    glm::vec3 position_{};
    std::vector<uint32_t> around_keep_, around_gone_, dying_;
    std::vector<Changed> changed_;
    std::vector<std::array<uint32_t, 2>> attached_to_; // witness, and the triangle that takes it
    std::vector<uint32_t> taker_;                      // the same, by witness
    std::vector<uint32_t> slot_;                       // of a triangle in changed_
    NearProof proof_;
    std::vector<uint32_t> looked_at_;   // the judgement in which an original triangle was
    std::vector<uint32_t> seen_;        // the judgement in which a triangle became a candidate
    std::vector<uint32_t> hint_;        // a triangle that an original one was near
    std::vector<Candidate> originals_;  // near the edge
    std::vector<Candidate> candidates_; // triangles near it, as if it had collapsed
    uint32_t judgement_ = 0;
    std::vector<uint32_t> mark_;
    uint32_t mark_now_ = 0;
};

} // namespace palpate
