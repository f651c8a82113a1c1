#include "apps/view/document/mesh_pulling.h"

#include <atomic>
#include <functional>
#include <future>

#include "apps/view/tools/click_tools.h"
#include "apps/view/tools/scissors_tool.h"
#include "engine/base/failure.h"
#include "engine/edit/spared.h"
#include "engine/program/surface_labels.h"
#include "engine/segment/label_merge.h"
#include "engine/segment/mesh_fit.h"
#include "engine/volume/content_hash.h"

namespace palpate::view {

// A mesh at its making from a label, or labels at a change that takes a while.
struct MeshPulling::MeshRun {
    struct Done { // one of the two
        std::optional<SimplexMesh> mesh;
        std::optional<Volume> labels{}; // as they become
        // The labels' step in the list of edits, and what a person is told after the label's new
        // volume.
        const char *step = "", *told = "";
        const char* unchanged = nullptr;      // else, where no sample changes; null: the same words
        bool is_of_mesh = false;              // that is pulled, and then is done with
        uint16_t met_locked = 0;              // Spared::met; start() finds it
        bool met_mask = false;                // likewise
        uint64_t count_before = 0, count = 0; // of the label's samples; start() counts
        bool is_unchanged = false;            // start() looks
    };
    ~MeshRun() { stop.request_stop(); }
    Task task() {
        return {stop.get_token(), [this](double s) { share = s; }};
    }

    uint16_t label;
    Volume before; // the labels that it reads
    EditLimits limits;
    std::stop_source stop{};
    std::atomic<double> share{0.0};
    std::future<Result<Done>> done{}; // last: its thread ends before the rest goes
};

MeshPulling::MeshPulling(OpenDocument& document) : document_(document) {}
MeshPulling::~MeshPulling() = default;

std::optional<double> MeshPulling::share() const {
    return run_ ? std::optional(run_->share.load()) : std::nullopt;
}

// Runs `work` on the labels, on a thread of its own if there are threads.
template <class Make>
void MeshPulling::start(uint16_t label, Make make) {
    run_.reset(new MeshRun{label, document_.labels_or_empty(), document_.limits()});
    const auto work = [run = run_.get(), make]() -> Result<MeshRun::Done> {
        PALPATE_TRY(MeshRun::Done done, make(*run));
        if (!done.labels)
            return done;
        Spared kept = sparing(run->before, *done.labels, run->limits);
        done.labels = std::move(kept.labels);
        done.met_locked = kept.met;
        done.met_mask = kept.met_mask;
        done.count_before = count_labels(run->before)[run->label];
        done.count = count_labels(*done.labels)[run->label];
        done.is_unchanged = done.labels->is_same_as(run->before) ||
                            content_hash(*done.labels) == content_hash(run->before);
        return done;
    };
    run_->done =
        std::async(document_.threaded() ? std::launch::async : std::launch::deferred,
                   [work, label] { return attempt(fmt::format("label {}", label), work); });
    if (!document_.threaded())
        run_->done.wait();
    poll();
}

void MeshPulling::make(uint16_t label) {
    if (run_)
        return;
    start(label, [volume = document_.grey()](MeshRun& run) -> Result<MeshRun::Done> {
        PALPATE_TRY(MeshFit fit, fit_mesh(volume, run.before, {.label = run.label}, run.task()));
        return MeshRun::Done{std::move(fit.mesh)};
    });
}

void MeshPulling::apply() {
    if (run_ || !mesh_)
        return;
    start(mesh_->label(), [mesh = mesh_->mesh()](MeshRun& run) -> Result<MeshRun::Done> {
        PALPATE_TRY(const Volume found,
                    rasterised(mesh, run.before.grid(), run.label, run.task().part(0.0, 0.8)));
        const uint16_t of[] = {run.label};
        PALPATE_TRY(Volume labels, with_labels(run.before, found, of, run.task().part(0.8, 1.0)));
        return MeshRun::Done{{}, std::move(labels), "pulled mesh", "by the mesh", nullptr, true};
    });
}

void MeshPulling::drop() {
    if (run_)
        run_->stop.request_stop();
    else
        mesh_.reset();
}

void MeshPulling::poll() {
    if (!run_ || run_->done.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
        return;
    Result<MeshRun::Done> done = run_->done.get();
    const std::unique_ptr<MeshRun> run = std::move(run_);
    if (!done) {
        document_.tell(done.error().message);
        return;
    }
    if (done->mesh) {
        mesh_.emplace(std::move(*done->mesh), run->label);
        return;
    }
    const std::optional<Volume> labels = document_.labels();
    if (labels && !labels->is_same_as(run->before)) {
        document_.tell("the labels have changed meanwhile: try again");
    } else if (done->is_unchanged) {
        document_.tell(done->unchanged
                           ? fmt::format("label {} {}", run->label, done->unchanged)
                           : fmt::format("label {} {}: no sample changes", run->label, done->told));
        if (mesh_ && done->is_of_mesh)
            mesh_->mark_applied();
    } else {
        if (!document_.put_labels(std::move(*done->labels), done->step))
            return;
        const double ml = 1e-3 * document_.label_sample_mm3().value_or(0.0);
        document_.tell(fmt::format("label {}: {:.1f} ml {}, {:.1f} ml before", run->label,
                                   ml * static_cast<double>(done->count), done->told,
                                   ml * static_cast<double>(done->count_before)));
        if (done->met_locked != 0)
            document_.tell_also(document_.locked_text(done->met_locked));
        if (done->met_mask)
            document_.tell_also(kMaskText);
        if (done->is_of_mesh)
            mesh_.reset();
    }
}

namespace {

using ChangeOfLabel =
    std::function<Result<Volume>(const Volume&, const LabelChangeInput&, const Task&)>;

// A change by what a person has drawn or clicked is one of its state.
ChangeOfLabel change_of(const LabelChange& change, const ViewState& state, const Volume& grey) {
    if (&change == &kEraseByScissors || &change == &kFillByScissors)
        return [cut = state.own.of<Cutting>().cut](const Volume& labels, const LabelChangeInput& in,
                                                   const Task& task) {
            return cut_labels(labels, cut, in.locked, task);
        };
    if (&change == &kLocalChange || &change == &kTraceChange)
        return [grey, click = state.own.of<Clicking>().clicked](
                   const Volume& labels, const LabelChangeInput& in,
                   const Task& task) -> Result<Volume> {
            PALPATE_TRY(const ClickRegion region, region_of(grey, click, task.part(0.0, 0.2)));
            PALPATE_TRY(const Volume found,
                        volume_of(region, labels.grid(), in.label, task.part(0.2, 0.5)));
            return with_labels(labels, found, {}, task.part(0.5, 1.0));
        };
    return change.change;
}

} // namespace

void MeshPulling::change(const ViewState& state, const LabelChange& change) {
    if (run_)
        return document_.tell("another change of the labels is under way");
    if (is_locked(state, state.label))
        return document_.tell(fmt::format("label {} is locked", state.label));
    start(
        state.label,
        [&change, make = change_of(change, state, document_.grey()), by_mm = state.change_label_mm,
         at_mm = state.crosshair_mm](MeshRun& run) -> Result<MeshRun::Done> {
            LabelChangeInput in{run.label, by_mm, run.limits.spared};
            if (const auto at = sample_at(run.before.grid(), at_mm))
                in.at = *at;
            PALPATE_TRY(Volume labels, make(run.before, in, run.task()));
            return MeshRun::Done{
                {}, std::move(labels), change.title, change.told, change.unchanged};
        });
}

} // namespace palpate::view
