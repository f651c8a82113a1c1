// The part of a document's work that segments: seeds, methods, and what comes of them.

#include <algorithm>

#include "apps/view/document/work.h"
#include "apps/view/tools/wire_tool.h"
#include "engine/measure/measure_report.h"
#include "engine/segment/map_values.h"
#include "engine/volume/builder.h"

namespace palpate::view {

namespace {

// The seeds as a method takes them: each is its label, and what is no object is kSeedOf255.
Result<Volume> seeds_by_label(const Volume& seeds) {
    constexpr uint16_t kOutside = Work::kOutside, kOther = Work::kSeedOf255;
    if (!(seeds.range().max >= kOutside))
        return seeds;
    return map_values<uint16_t>(std::array{&seeds}, {}, [](std::array<float, 1> seed) {
        const auto one = static_cast<uint16_t>(seed[0]);
        return one == kOutside ? kOther : one == kOther ? kOutside : one;
    });
}

} // namespace

bool Work::put_seeds() {
    return edited().document.find(kSeeds) ||
           session().put({kSeeds, VolumeKind::labels, empty_labels(subject_.grid)}, "seeds");
}

void Work::show_seeds(const ViewState& state) {
    SessionSources sources = session().sources();
    // Seen in yellow: what a method has come to, or what the bound that is dragged would give.
    const bool previews = segment_look_ || (state.segmenting.preview && strength_);
    std::optional<Volume> shown;
    if (previews)
        shown = segment_look_ ? *segment_look_ : strength_->volume;
    const EditState now = edited();
    const Volume* seeds = now.document.find(kSeeds);
    const bool has_seeds = seeds && seeds->range().max > 0.0f;
    const bool same_fused =
        sources.fused.has_value() == previews && (!previews || sources.fused->is_same_as(*shown));
    if ((sources.overlay == kSeeds) != has_seeds || !same_fused) {
        sources.overlay = has_seeds ? kSeeds : "";
        sources.fused = shown;
        session().choose(std::move(sources));
    }
    Scene scene = session().scene();
    if (has_seeds && !scene.overlay)
        scene.overlay = LabelLayer{};
    if (!previews) {
        scene.fusion = fusion();
    } else {
        const double at = segment_look_ ? 0.5 : *state.segmenting.preview;
        const bool below = !segment_look_ && is_object_below(*strength_->method);
        TransferFunction step;
        step.colors = {{at, {1.0, 0.8, 0.1}}};
        step.opacities = {{at, below ? 1.0 : 0.0}, {at, below ? 0.0 : 1.0}};
        scene.fusion = FusionLayer{step, 0.5};
    }
    if (scene != session().scene())
        session().show(std::move(scene));
}

std::optional<double> Work::segmenting() const {
    return segmenting_ ? std::optional(segmenting_->share()) : std::nullopt;
}

void Work::begin_segmenting(const ViewState& state) {
    const SegmentMethod* method = find_segment_method(state.segmenting.method);
    if (!method || segmenting_)
        return;
    const EditState now = edited();
    const Volume* labels = now.document.find(labels_name());
    const Volume* seeds = now.document.find(kSeeds);
    if (method->takes_seeds && !(seeds && seeds->range().max > 0.0f)) {
        message_ = fmt::format("{}: paint seeds first (Q)", method->name);
        return;
    }
    const auto given = state.segmenting.given.find(state.segmenting.method);
    SegmentJob job{
        .method = method,
        .given = given == state.segmenting.given.end() ? ParameterValues() : given->second,
        .volume = *now.document.find(grey_name()),
        .labels = labels ? *labels : empty_labels(subject_.grid),
        .outside = kSeedOf255,
        .locked = state.notes.locked_labels,
        .label = state.label};
    if (method->takes_seeds) {
        Result<Volume> by_label = seeds_by_label(*seeds);
        if (!by_label) {
            message_ = fmt::format("{}: {}", method->name, by_label.error().message);
            return;
        }
        job.seeds = std::move(*by_label);
    }
    run_segmenting(std::move(job));
}

void Work::begin_bounding(const ViewState& state) {
    if (segmenting_ || !strength_ || !state.segmenting.preview)
        return;
    const EditState now = edited();
    const Volume* labels = now.document.find(labels_name());
    SegmentJob job{.method = strength_->method,
                   .given = {{"bound", *state.segmenting.preview}},
                   .volume = strength_->volume,
                   .labels = labels ? *labels : empty_labels(subject_.grid),
                   .locked = state.notes.locked_labels,
                   .again = strength_};
    job.again->bound = *state.segmenting.preview;
    run_segmenting(std::move(job));
}

void Work::run_segmenting(SegmentJob job) {
    segmenting_ = std::make_unique<SegmentRun>(std::move(job), threaded());
    poll_segmenting();
}

std::optional<double> Work::found(const SegmentMethod& method, const char* parameter) const {
    const auto of = found_.find(method.name);
    if (of == found_.end())
        return std::nullopt;
    const auto value = of->second.find(parameter);
    return value == of->second.end() ? std::nullopt : std::optional(value->second);
}

// A result in words that a person should read: how large its labels are then, and what was found.
std::string Work::told_of(const SegmentJob& job, const SegmentDone& done) {
    const auto counts = label_counts(done.labels);
    std::string told;
    for (const uint16_t label : done.of) {
        const auto found = std::ranges::find(counts, label, &LabelCount::label);
        const double samples = found == counts.end() ? 0.0 : static_cast<double>(found->count);
        told += fmt::format("{}label {}: {}", told.empty() ? "" : ", ", label,
                            ml_text(samples * label_sample_mm3().value_or(0.0)));
    }
    if (job.again)
        told += fmt::format(" {} {:.4g}",
                            is_object_below(*job.method) ? "by" : "at a strength of at least",
                            job.again->bound);
    for (const std::string& note : done.notes)
        told += (told.empty() ? "" : "; ") + note;
    if (done.strength && done.strength->is_unbounded && done.strength->least < done.strength->most)
        return told + "; drag `bound` in the tab segment";
    return done.labels.is_same_as(job.labels) ? "no sample changed; " + told : told;
}

void Work::poll_segmenting() {
    if (!segmenting_ || down_)
        return;
    if (std::optional<Volume> look = segmenting_->take_look(); look && !touch_.running())
        segment_look_ = std::move(look); // what is chosen to be seen is chosen anew to be felt
    std::optional<Result<SegmentDone>> taken = segmenting_->take();
    if (!taken)
        return;
    const std::unique_ptr<SegmentRun> run = std::move(segmenting_);
    segment_look_.reset();
    const SegmentJob& job = run->job();
    if (!*taken) {
        message_ = taken->error().message;
        return;
    }
    SegmentDone& done = **taken;
    session().settle();
    const EditState now = edited();
    const Volume* labels = now.document.find(labels_name());
    const std::vector<uint16_t>& locked = notes().known().locked_labels;
    const bool changes = !done.labels.is_same_as(job.labels);
    // A person has gone on drawing, or has locked a label. While a hand draws without a pause, this
    // goes on, and the result comes after.
    if (changes && labels && (!labels->is_same_as(job.labels) || locked != job.locked)) {
        SegmentJob anew = job;
        if (!job.ready) {
            anew.before = job.labels;
            anew.ready = std::make_shared<const SegmentDone>(std::move(done));
        }
        anew.labels = *labels;
        anew.locked = locked;
        return run_segmenting(std::move(anew));
    }
    const std::string told = told_of(job, done);
    if (!job.again)
        std::erase_if(found_[job.method->name],
                      [&](const auto& old) { return !job.given.contains(old.first); });
    for (const auto& [name, value] : done.found)
        if (!job.given.contains(name)) // else a person chose it
            found_[job.method->name].insert_or_assign(name, value);
    Json parameters = Json::object();
    for (const auto& [name, value] : job.given)
        parameters[name] = value;
    const std::string title =
        job.again ? fmt::format("{}, bounded anew", job.method->name) : job.method->name;
    Notes after = notes().known();
    after.bound.reset();
    if (done.strength)
        after.bound = {done.strength->method->name, done.strength->id, done.strength->bound};
    const NotePages::Texts noted = notes().changes_to(after);
    if (changes ? !session().put({labels_name(), VolumeKind::labels, std::move(done.labels)}, title,
                                 std::move(parameters), noted)
                : !session().note(noted, "bound", false))
        return;
    notes().expect_change();
    strength_ = std::move(done.strength);
    if (strength_)
        keep_strength();
    message_ = told;
}

Json Work::dump_segmenting(const ViewState& state) const {
    constexpr const char* brushes[] = {"inside", "outside", "erase"};
    Json json{{"brush", brushes[static_cast<size_t>(state.segmenting.brush)]},
              {"method", state.segmenting.method},
              {"runs", segmenting_ != nullptr},
              {"wire_samples", state.own.of<Wiring>().frozen.size()}};
    for (const auto& [method, values] : state.segmenting.given)
        for (const auto& [name, value] : values)
            json["given"][method][name] = value;
    if (strength_)
        json["bound"] = strength_->bound;
    return json;
}

std::optional<EditSetup> Work::seed_brush(const ViewState& state, TipShape shape) {
    const SeedBrush brush = state.segmenting.brush;
    if (brush == SeedBrush::inside && state.label > kLastSeeded) {
        message_ = fmt::format("seeds are of labels 1 .. {}, found {}", kLastSeeded, state.label);
        return std::nullopt;
    }
    if (!put_seeds())
        return std::nullopt;
    ToolFor made_for = tool_for();
    made_for.labels = kSeeds;
    const uint16_t label = brush != SeedBrush::inside ? kOutside
                           : state.label == kOutside  ? kSeedOf255
                                                      : state.label;
    return make_tool(brush == SeedBrush::erase ? Carve::erase : Carve::draw, shape, state.radius_mm,
                     label, 0.0, made_for);
}

} // namespace palpate::view
