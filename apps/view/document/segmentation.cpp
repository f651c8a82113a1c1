#include "apps/view/document/segmentation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/view/document/net_method.h"
#include "apps/view/document/stroke_edit.h"
#include "apps/view/tools/clip_tool.h"
#include "engine/measure/measure_report.h"
#include "engine/segment/map_values.h"
#include "engine/volume/extent.h"

namespace palpate::view {

namespace {

constexpr glm::dvec3 kOutsideColor{1.0, 0.3, 0.1}; // red: the first labels have other colours

// The seeds as a method takes them: each is its label, and what is no object is kSeedOf255.
Result<Volume> seeds_by_label(const Volume& seeds) {
    if (!(seeds.range().max >= kOutsideSeed))
        return seeds;
    return map_values<uint16_t>(std::array{&seeds}, {}, [](std::array<float, 1> seed) {
        const auto one = static_cast<uint16_t>(seed[0]);
        return one == kOutsideSeed ? kSeedOf255 : one == kSeedOf255 ? kOutsideSeed : one;
    });
}

// Seeds have the colours of their labels, and are seen where these are hidden. Those outside have a
// colour of their own.
std::vector<LabelStyle> seed_styles(const std::optional<LabelLayer>& labels) {
    std::vector<LabelStyle> styles = labels ? labels->styles : std::vector<LabelStyle>();
    for (LabelStyle& style : styles)
        style.visible = true;
    for (auto label = static_cast<uint32_t>(styles.size()); label <= kOutsideSeed; ++label)
        styles.push_back(style_of(LabelLayer{}, label));
    styles[kOutsideSeed] = {.color = kOutsideColor};
    return styles;
}

bool has_samples(const std::optional<Volume>& map) {
    return map && map->range().max > 0.0f;
}

} // namespace

Segmentation::Segmentation(OpenDocument& document, const HandLink& hand)
    : document_(document), hand_(hand), wire_(document) {}

void Segmentation::show(const ViewState& state) {
    Session& session = document_.session();
    SessionSources sources = session.sources();
    // Seen in yellow: what a method has come to, or what the bound that is dragged would give.
    const bool previews = look_ || (state.segmenting.preview && strength_);
    std::optional<Volume> shown;
    if (previews)
        shown = look_ ? *look_ : strength_->volume;
    const bool has_seeds = has_samples(document_.seeds());
    const bool same_fused =
        sources.fused.has_value() == previews && (!previews || sources.fused->is_same_as(*shown));
    if ((sources.overlay == OpenDocument::kSeeds) != has_seeds || !same_fused) {
        sources.overlay = has_seeds ? OpenDocument::kSeeds : "";
        sources.fused = shown;
        session.choose(std::move(sources));
    }
    Scene scene = session.scene();
    if (has_seeds) {
        if (!scene.overlay)
            scene.overlay = LabelLayer{};
        scene.overlay->styles = seed_styles(scene.labels);
    }
    if (!previews) {
        scene.fusion = document_.fusion();
    } else {
        const double at = look_ ? 0.5 : *state.segmenting.preview;
        const bool below = !look_ && is_object_below(*strength_->method);
        TransferFunction step;
        step.colors = {{at, {1.0, 0.8, 0.1}}};
        step.opacities = {{at, below ? 1.0 : 0.0}, {at, below ? 0.0 : 1.0}};
        scene.fusion = FusionLayer{step, 0.5};
    }
    if (scene != session.scene())
        session.show(std::move(scene));
}

std::optional<SegmentJob::Region> kept_samples(const Grid& grid,
                                               const std::vector<ClipPlane>& planes) {
    glm::dvec3 low(INFINITY), high(-INFINITY);
    const auto take = [&](glm::dvec3 point_mm) {
        const glm::dvec3 index = index_point(grid, point_mm);
        low = glm::min(low, index);
        high = glm::max(high, index);
    };
    for (size_t i = 0; i < planes.size(); ++i)
        for (const glm::dvec3 corner : clip_outline(grid, planes, i))
            take(corner);
    const double room = 1e-6 * extent_mm(grid);
    const glm::dvec3 last = glm::dvec3(grid.size) - 1.0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 point =
            world_point(grid, last * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2));
        if (std::ranges::all_of(planes, [&](const ClipPlane& plane) {
                return glm::dot(plane.normal, point - plane.point_mm) >= -room;
            }))
            take(point);
    }
    constexpr double kOn = 1e-6; // a plane may lie on samples
    SegmentJob::Region kept{glm::ivec3(glm::ceil(glm::max(low, glm::dvec3(0.0)) - kOn)),
                            glm::ivec3(glm::floor(glm::min(high, last) + kOn))};
    const bool has_any = low.x <= high.x && glm::all(glm::lessThanEqual(kept.low, kept.high));
    return has_any ? std::optional(kept) : std::nullopt;
}

double Segmentation::expected_s(const ViewState& state) const {
    const Grid& grid = document_.subject().grid;
    uint64_t samples = sample_count(grid);
    if (state.segmenting.in_box && !state.notes.clip_planes.empty())
        if (const auto kept = kept_samples(grid, state.notes.clip_planes)) {
            const glm::u64vec3 size(kept->high - kept->low + 1);
            samples = size.x * size.y * size.z;
        }
    return times_.expected_s(state.segmenting.method, samples);
}

std::optional<double> Segmentation::share() const {
    return run_ ? std::optional(run_->share()) : std::nullopt;
}

void Segmentation::begin(const ViewState& state) {
    const SegmentMethod* method = find_method_or_net(state.segmenting.method);
    if (!method || run_)
        return;
    const std::optional<Volume> seeds = document_.seeds();
    if (method->takes_seeds && !has_samples(seeds))
        return document_.tell(fmt::format("{}: paint seeds first (Q)", method->name));
    const auto given = state.segmenting.given.find(state.segmenting.method);
    SegmentJob job{
        .method = method,
        .given = given == state.segmenting.given.end() ? ParameterValues() : given->second,
        .volume = document_.grey(),
        .labels = document_.labels_or_empty(),
        .outside = kSeedOf255,
        .limits = document_.limits(),
        .label = state.label};
    if (state.segmenting.in_box && !state.notes.clip_planes.empty() && method != &net_method()) {
        job.region = kept_samples(job.volume.grid(), state.notes.clip_planes);
        if (!job.region)
            return document_.tell("no sample lies within the clip planes");
    }
    // A threshold begins where the surface in 3D lies: of a CT, at bone.
    if (std::string_view(method->name) == "threshold" && job.given.empty())
        job.given["low"] = document_.session().parameters().iso;
    if (method->takes_seeds) {
        Result<Volume> by_label = seeds_by_label(*seeds);
        if (!by_label)
            return document_.tell(fmt::format("{}: {}", method->name, by_label.error().message));
        job.seeds = std::move(*by_label);
    }
    if (method == &net_method()) {
        Result<std::shared_ptr<KeptRun>> net = net_run(state.own.of<NetWish>(), job.volume);
        if (!net)
            return document_.tell(net.error().message);
        kept_run_ = std::move(*net);
    }
    run(std::move(job));
}

void Segmentation::bound(const ViewState& state) {
    if (run_ || !strength_ || !state.segmenting.preview)
        return;
    SegmentJob job{.method = strength_->method,
                   .given = {{"bound", *state.segmenting.preview}},
                   .volume = strength_->volume,
                   .labels = document_.labels_or_empty(),
                   .limits = document_.limits(),
                   .again = strength_};
    job.again->bound = *state.segmenting.preview;
    run(std::move(job));
}

void Segmentation::stop() {
    if (run_)
        run_->stop();
}

void Segmentation::run(SegmentJob job) {
    if (!job.again && !job.ready)
        job.kept = std::exchange(kept_run_, nullptr);
    began_ = std::chrono::steady_clock::now();
    run_ = std::make_unique<SegmentRun>(std::move(job), document_.threaded());
    poll();
}

std::optional<double> Segmentation::found(const SegmentMethod& method,
                                          const char* parameter) const {
    const auto of = found_.find(method.name);
    if (of == found_.end())
        return std::nullopt;
    const auto value = of->second.find(parameter);
    return value == of->second.end() ? std::nullopt : std::optional(value->second);
}

// A result in words that a person should read: how large its labels are then, and what was found.
std::string Segmentation::told_of(const SegmentJob& job, const SegmentDone& done) {
    const auto counts = label_counts(done.labels);
    std::string told;
    for (const uint16_t label : done.of) {
        const auto found = std::ranges::find(counts, label, &LabelCount::label);
        const double samples = found == counts.end() ? 0.0 : static_cast<double>(found->count);
        told += fmt::format("{}label {}: {}", told.empty() ? "" : ", ", label,
                            ml_text(samples * document_.label_sample_mm3().value_or(0.0)));
    }
    if (job.again)
        told += fmt::format(" {} {:.4g}",
                            is_object_below(*job.method) ? "by" : "at a strength of at least",
                            job.again->bound);
    if (std::string_view(job.method->name) == "threshold" && job.given.contains("low"))
        told += fmt::format(", values from {:g}", job.given.at("low"));
    if (done.met_locked != 0)
        told += fmt::format("; {}", document_.locked_text(done.met_locked));
    if (done.met_mask)
        told += fmt::format("; {}", kMaskText);
    for (const std::string& note : done.notes)
        told += (told.empty() ? "" : "; ") + note;
    if (done.strength && done.strength->is_unbounded && done.strength->least < done.strength->most)
        return told + "; drag `bound` in the task Segment";
    return done.labels.is_same_as(job.labels) ? "no sample changed; " + told : told;
}

void Segmentation::poll() {
    if (!run_ || hand_.is_drawing())
        return;
    if (std::optional<Volume> look = run_->take_look(); look && !hand_.touch().running())
        look_ = std::move(look); // what is chosen to be seen is chosen anew to be felt
    std::optional<Result<SegmentDone>> taken = run_->take();
    if (!taken)
        return;
    const std::unique_ptr<SegmentRun> ended = std::move(run_);
    if (ended->kept())
        kept_run_ = ended->kept();
    look_.reset();
    const SegmentJob& job = ended->job();
    // A script is a function of its input, whatever the time.
    if (*taken && document_.threaded() && !job.again && !job.ready) {
        const glm::u64vec3 size(job.region ? glm::uvec3(job.region->high - job.region->low + 1)
                                           : job.volume.size());
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began_;
        times_.note(job.method->name, size.x * size.y * size.z, took.count());
    }
    if (*taken)
        take(job, std::move(**taken));
    else
        document_.tell(taken->error().message);
}

// Puts a result into the document.
void Segmentation::take(const SegmentJob& job, SegmentDone done) {
    NotesLink& notes = document_.notes();
    document_.session().settle();
    const std::optional<Volume> labels = document_.labels();
    const EditLimits limits = document_.limits();
    const bool changes = !done.labels.is_same_as(job.labels);
    // A person has gone on drawing, has locked a label, or has changed the mask. While a hand draws
    // without a pause, this goes on, and the result comes after.
    if (changes && labels &&
        (!labels->is_same_as(job.labels) || limits.spared != job.limits.spared ||
         limits.mask != job.limits.mask)) {
        SegmentJob anew = job;
        if (!job.ready) {
            anew.before = job.labels;
            anew.ready = std::make_shared<const SegmentDone>(std::move(done));
        }
        anew.labels = *labels;
        anew.limits = limits;
        return run(std::move(anew));
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
    const std::string step =
        job.again ? fmt::format("{}, bounded anew", job.method->name) : job.method->name;
    Notes noted = notes.known();
    noted.bound.reset();
    if (done.strength)
        noted.bound = {done.strength->method->name, done.strength->id, done.strength->bound};
    const NotePages::Texts pages = notes.changes_to(noted);
    if (changes ? !document_.put_labels(std::move(done.labels), step, std::move(parameters), pages)
                : !document_.session().note(pages, "bound", false))
        return;
    notes.expect_change();
    strength_ = std::move(done.strength);
    if (strength_)
        keep_strength();
    document_.tell(told);
}

void Segmentation::follow_bound() {
    const std::optional<Notes::Bound>& bound = document_.notes().known().bound;
    if (strength_ && bound && strength_->id == bound->strength && strength_->bound == bound->value)
        return;
    strength_.reset();
    for (const Strength& one : kept_) {
        if (!bound || one.id != bound->strength || one.method->name != bound->method)
            continue;
        strength_ = one;
        if (one.bound == bound->value) // else of the same run, bounded anew since then
            break;
        strength_->bound = bound->value;
    }
}

void Segmentation::keep_strength() {
    constexpr size_t kMost = 4; // each is as large as the volume
    std::erase_if(kept_, [&](const Strength& one) {
        return one.id == strength_->id && one.is_unbounded == strength_->is_unbounded;
    });
    kept_.push_back(*strength_);
    if (kept_.size() > kMost)
        kept_.pop_front();
}

} // namespace palpate::view
