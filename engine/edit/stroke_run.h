#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <unordered_map>
#include <vector>

#include "engine/edit/alike.h"
#include "engine/edit/operation.h"
#include "engine/edit/sample_mask.h"
#include "engine/volume/edit.h"

namespace palpate {

class RegionSearch;

// One stroke while it happens, from tool-down to tool-up.
//
// Poses are added as they arrive; work() applies them in slices; publish() makes a snapshot of the
// work so far. The final result is a function of the snapshot at tool-down and of the poses
// (operation.h): the same bytes for any portions of poses, any slices, any number of threads. One
// thread calls this; work() uses all cores.
class StrokeRun {
 public:
    // Fails as check(operation, ...) does, and does it settled(). The guide is for an operation
    // that needs_guide().
    static Result<std::unique_ptr<StrokeRun>> start(Volume before, Tool tool, Operation operation,
                                                    std::optional<Volume> guide = {});
    ~StrokeRun();

    // Poses after those already added. A stroke of one pose is a dab.
    void add(std::span<const StrokePose> poses);

    // Tool-up: no pose follows, and fill and islands may begin.
    void lift() { lifted_ = true; }

    // Works until nothing is left, which returns true, or until go_on says false, which is asked
    // every few bricks. `stop` is looked at in every row of samples, so that no sweep, however
    // long, keeps a program from ending; once it is requested this returns false, the stroke cannot
    // go on, and nothing of it is published any more.
    bool work(const std::function<bool()>& go_on, const std::stop_token& stop = {});
    void work() {
        work([] { return true; });
    }

    // The snapshot so far; the last one where nothing has changed since. It is u16 where a label
    // above 255 was drawn into a map of u8, and before() itself as long as no sample has changed.
    Volume publish();
    const Volume& before() const { return given_; }

    uint64_t samples_seen() const { return samples_seen_; } // in T, each once
    // The lowest spared label of which a sample would have changed otherwise, so far; 0: none.
    uint16_t met_spared() const { return met_spared_; }

 private:
    struct Segment { // between two poses
        StrokePose from, to;
        Sweep sweep;
    };
    struct Touched;
    enum class Freedom : uint8_t { none, spared, free }; // spared: free, were it not locked
    StrokeRun(Volume before, Tool tool, Operation operation, std::optional<Volume> guide);
    void add_segment(const StrokePose& from, const StrokePose& to);
    void add_dabs(const StrokePose& from, const StrokePose& to);
    void flood_dabs(const std::stop_token& stop); // the next of them
    Touched& touched(glm::uvec3 brick);
    void work_on(std::span<Touched* const> bricks, const std::stop_token& stop);
    void find_samples(Touched& brick, SampleMask& fresh, const std::stop_token& stop) const;
    void add_near(Touched& brick, SampleMask& fresh, const Sweep& sweep,
                  const std::stop_token& stop) const;
    void add_dose(Touched& brick, SampleMask& fresh, const Segment& segment,
                  const std::stop_token& stop) const;
    void keep_values(SampleMask& mask, glm::uvec3 brick) const;
    void keep_area(SampleMask& mask, glm::uvec3 brick) const;
    void keep_unspared(Touched& brick, SampleMask& mask) const;
    double wall_value(const Touched& brick, double value, glm::ivec3 place) const;
    template <class T>
    void change(Touched& brick, const SampleMask& fresh, std::span<T> out,
                const std::stop_token& stop) const;

    const Volume given_;  // as it was at tool-down
    Volume before_, now_; // the same samples, in the type that holds the stroke's label
    Tool tool_;
    Operation operation_;
    std::optional<Volume> guide_;
    std::vector<Freedom> freedoms_; // by label
    std::vector<bool> area_;        // by label; empty: everywhere
    std::optional<StrokePose> last_;
    bool lifted_ = false;
    bool stopped_ = false; // somewhere within a slice
    std::unordered_map<uint64_t, std::unique_ptr<Touched>> bricks_;
    std::deque<Touched*> waiting_;
    std::optional<AlikeRange> alike_; // of operations that keep to edges, from the first pose on
    std::deque<StrokePose> dabs_;     // of these: not looked at yet
    std::unique_ptr<RegionSearch> regions_; // of fill and islands, from tool-up on
    std::optional<VolumeEdit> edit_;
    uint64_t samples_seen_ = 0;
    uint16_t met_spared_ = 0;
};

// A whole stroke at once.
Result<Volume> apply_stroke(const Volume& before, const Tool& tool, const Operation& operation,
                            std::span<const StrokePose> poses, std::optional<Volume> guide = {});

} // namespace palpate
