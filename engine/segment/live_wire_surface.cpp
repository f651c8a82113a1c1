#include "engine/segment/live_wire_surface.h"

#include <algorithm>
#include <cmath>

#include "engine/segment/brick_array.h"
#include "engine/segment/rows.h"
#include "engine/segment/smooth_interpolant.h"
#include "engine/segment/wire_curves.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

// Values 0 at places on the curves, evenly spread, and `off` beside them along the normal.
SmoothInterpolant through(const WireBody& body, double sample_mm) {
    double length_mm = 0.0;
    for (const std::vector<SurfacePoint>& curve : body.curves)
        for (size_t i = 0; i < curve.size(); ++i)
            length_mm += glm::distance(curve[i].at_mm, curve[(i + 1) % curve.size()].at_mm);
    const double apart_mm = std::max(2.0 * length_mm / double(kMostPlaces), sample_mm);
    const double off_mm = 0.5 * apart_mm;
    std::vector<glm::dvec3> places;
    std::vector<double> values;
    const auto add = [&](glm::dvec3 at, double value) {
        for (const glm::dvec3 p : places)
            if (glm::distance(p, at) < 0.4 * apart_mm)
                return; // where curves cross
        places.push_back(at);
        values.push_back(value);
    };
    for (const double side : {0.0, off_mm})
        for (const std::vector<SurfacePoint>& curve : body.curves) {
            double walked_mm = apart_mm;
            for (size_t i = 0; i < curve.size(); ++i) {
                if (walked_mm >= apart_mm) {
                    add(curve[i].at_mm + side * curve[i].normal, side);
                    walked_mm = 0.0;
                }
                walked_mm += glm::distance(curve[i].at_mm, curve[(i + 1) % curve.size()].at_mm);
            }
        }
    return {places, values};
}

// The steps to the 26 neighbours of a sample; those over faces first.
std::vector<glm::ivec3> neighbour_steps() {
    std::vector<glm::ivec3> steps;
    for (int n = 0; n < 27; ++n)
        if (n != 13)
            steps.emplace_back(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    std::stable_sort(steps.begin(), steps.end(), [](glm::ivec3 a, glm::ivec3 b) {
        return glm::dot(glm::vec3(a), glm::vec3(a)) < glm::dot(glm::vec3(b), glm::vec3(b));
    });
    return steps;
}
constexpr size_t kFaces = 6;

// Facts known of a sample.
enum : uint8_t { kInner = 1, kOuter = 2, kSurface = 4, kMet = 8 };

// A body in the box of its samples, one sample wider to each side: also beyond the volume.
struct Body {
    uint16_t label;
    glm::ivec3 first{0}, size{0};
    std::vector<uint8_t> samples; // kSurface, kInner or kOuter

    size_t number(glm::ivec3 at) const {
        const glm::ivec3 p = at - first;
        return size_t(p.x) + size_t(size.x) * (size_t(p.y) + size_t(size.y) * size_t(p.z));
    }
};

class Tracker {
 public:
    Tracker(const Grid& grid, const WireBody& body)
        : grid_(grid),
          body_(body),
          steps_(neighbour_steps()),
          state_(grid.size),
          function_(through(body, smallest_spacing_mm(grid))) {}

    Result<Body> run(const Task& task) {
        std::vector<glm::ivec3> wave = samples_about_curves();
        WorldBox box{wave.empty() ? glm::dvec3(0.0) : body_.curves[0][0].at_mm,
                     body_.curves[0][0].at_mm};
        for (const std::vector<SurfacePoint>& curve : body_.curves)
            for (const SurfacePoint& point : curve) {
                box.low = glm::min(box.low, point.at_mm);
                box.high = glm::max(box.high, point.at_mm);
            }
        const glm::dvec3 more(0.5 * glm::distance(box.low, box.high));
        while (!wave.empty()) {
            if (task.stop.stop_requested())
                return stopped();
            evaluate(wave);
            std::vector<glm::ivec3> next;
            for (const glm::ivec3 at : wave) {
                if (!borders(at))
                    continue;
                if (is(at, kInner)) {
                    surface_.push_back(at);
                    const glm::dvec3 mm = world_point(grid_, glm::dvec3(at));
                    if (glm::any(glm::lessThan(mm, box.low - more)) ||
                        glm::any(glm::greaterThan(mm, box.high + more)))
                        return fail(
                            "the surface through the curves of label {} does not close: "
                            "it leads on to ({:.4g}, {:.4g}, {:.4g}) mm; draw a curve "
                            "that bounds it there",
                            body_.label, mm.x, mm.y, mm.z);
                }
                for (const glm::ivec3 step : steps_)
                    if (holds(at + step) && !is(at + step, kMet)) {
                        mark(at + step, kMet);
                        next.push_back(at + step);
                    }
            }
            wave = std::move(next);
        }
        return filled();
    }

 private:
    bool holds(glm::ivec3 at) const {
        return glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) &&
               glm::all(glm::lessThan(at, glm::ivec3(grid_.size)));
    }
    bool is(glm::ivec3 at, uint8_t what) const { return state_.value(glm::uvec3(at)) & what; }
    void mark(glm::ivec3 at, uint8_t what) {
        state_.set(glm::uvec3(at), uint8_t(state_.value(glm::uvec3(at)) | what));
    }

    // The surface is met about the curves.
    std::vector<glm::ivec3> samples_about_curves() {
        std::vector<glm::ivec3> wave;
        const auto meet = [&](glm::ivec3 at) {
            if (holds(at) && !is(at, kMet)) {
                mark(at, kMet);
                wave.push_back(at);
            }
        };
        for (const std::vector<SurfacePoint>& curve : body_.curves)
            for (const SurfacePoint& point : curve) {
                const glm::ivec3 at(glm::clamp(glm::round(index_point(grid_, point.at_mm)),
                                               glm::dvec3(0.0), glm::dvec3(grid_.size) - 1.0));
                meet(at);
                for (const glm::ivec3 step : steps_)
                    meet(at + step);
            }
        return wave;
    }

    // On which side the samples of a wave and their neighbours over faces lie.
    void evaluate(const std::vector<glm::ivec3>& wave) {
        std::vector<glm::ivec3> unknown;
        const auto ask = [&](glm::ivec3 at) {
            if (holds(at) && !is(at, kInner | kOuter)) {
                mark(at, kOuter); // for now: asked once
                unknown.push_back(at);
            }
        };
        for (const glm::ivec3 at : wave) {
            ask(at);
            for (size_t n = 0; n < kFaces; ++n)
                ask(at + steps_[n]);
        }
        std::vector<uint8_t> inner(unknown.size());
        run_all((unknown.size() + 255) / 256, {}, [&](size_t part) {
            for (size_t i = 256 * part; i < std::min(256 * part + 256, unknown.size()); ++i)
                inner[i] = function_(world_point(grid_, glm::dvec3(unknown[i]))) < 0.0;
        });
        for (size_t i = 0; i < unknown.size(); ++i)
            if (inner[i])
                state_.set(glm::uvec3(unknown[i]),
                           uint8_t((state_.value(glm::uvec3(unknown[i])) & ~kOuter) | kInner));
    }

    // Whether a neighbour over a face lies on the other side.
    bool borders(glm::ivec3 at) const {
        const bool inner = is(at, kInner);
        for (size_t n = 0; n < kFaces; ++n)
            if (const glm::ivec3 to = at + steps_[n];
                inner != (holds(to) && is(to, kInner)) && (inner || holds(to)))
                return true;
        return false;
    }

    // Outside is what can be reached from the border of the box over faces.
    Result<Body> filled() const {
        Body out{body_.label};
        if (surface_.empty())
            return fail("the surface through the curves of label {} holds no sample", body_.label);
        glm::ivec3 low = surface_.front(), high = low;
        for (const glm::ivec3 at : surface_) {
            low = glm::min(low, at);
            high = glm::max(high, at);
        }
        out.first = low - 1;
        out.size = high - low + 3;
        out.samples.assign(size_t(out.size.x) * size_t(out.size.y) * size_t(out.size.z), kInner);
        for (const glm::ivec3 at : surface_)
            out.samples[out.number(at)] = kSurface;
        std::vector<glm::ivec3> wave{out.first}, next;
        out.samples[0] = kOuter;
        size_t outer = 0;
        for (; !wave.empty(); wave.swap(next), next.clear())
            for (const glm::ivec3 at : wave) {
                ++outer;
                for (size_t n = 0; n < kFaces; ++n) {
                    const glm::ivec3 to = at + steps_[n], p = to - out.first;
                    if (glm::any(glm::lessThan(p, glm::ivec3(0))) ||
                        glm::any(glm::greaterThanEqual(p, out.size)) ||
                        out.samples[out.number(to)] != kInner)
                        continue;
                    out.samples[out.number(to)] = kOuter;
                    next.push_back(to);
                }
            }
        if (outer + surface_.size() == out.samples.size())
            return fail("the surface through the curves of label {} encloses no sample",
                        body_.label);
        return out;
    }

    const Grid& grid_;
    const WireBody& body_;
    std::vector<glm::ivec3> steps_;
    BrickArray<uint8_t> state_;
    SmoothInterpolant function_;
    std::vector<glm::ivec3> surface_;
};

template <class T>
Result<LiveWireSurface> volumes_of(const Grid& grid, const std::vector<Body>& bodies,
                                   const Task& task) {
    const auto make = [&](uint8_t parts) {
        return make_rows<T>(grid, {task.stop, {}}, [&](uint32_t y, uint32_t z, std::span<T> row) {
            for (const Body& body : bodies) {
                const glm::ivec3 low = glm::max(body.first, glm::ivec3(0));
                const glm::ivec3 end = glm::min(body.first + body.size, glm::ivec3(grid.size));
                if (int(y) < low.y || int(y) >= end.y || int(z) < low.z || int(z) >= end.z)
                    continue;
                for (int x = low.x; x < end.x; ++x)
                    if (row[size_t(x)] == 0 && body.samples[body.number({x, y, z})] & parts)
                        row[size_t(x)] = T(body.label);
            }
        });
    };
    PALPATE_TRY(Volume surface, make(kSurface));
    PALPATE_TRY(Volume labels, make(kSurface | kInner));
    return LiveWireSurface{std::move(surface), std::move(labels)};
}

} // namespace

Result<LiveWireSurface> live_wire_surface(const Grid& grid, std::span<const WireCurve> curves,
                                          const Task& task) {
    PALPATE_TRY(const std::vector<WireBody> drawn, wire_bodies(grid, curves));
    std::vector<Body> bodies;
    for (size_t i = 0; i < drawn.size(); ++i) {
        PALPATE_TRY(Body body, Tracker(grid, drawn[i]).run(task));
        bodies.push_back(std::move(body));
        if (task.progress)
            task.progress(double(i + 1) / double(drawn.size()));
    }
    return drawn.back().label < 256 ? volumes_of<uint8_t>(grid, bodies, task)
                                    : volumes_of<uint16_t>(grid, bodies, task);
}

} // namespace palpate
