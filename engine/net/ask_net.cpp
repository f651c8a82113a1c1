#include "engine/net/ask_net.h"

#include <algorithm>
#include <set>

#include "engine/base/printable.h"
#include "engine/volume/box.h"
#include "engine/volume/builder.h"

namespace palpate {

namespace {

std::vector<uint16_t> samples_of(const Volume& labels) {
    std::vector<uint16_t> samples(sample_count(labels.grid()));
    read_box<uint16_t>(labels, {0, 0, 0}, glm::ivec3(labels.size()), packed(labels.size()),
                       samples.data());
    return samples;
}

std::vector<uint8_t> where(const std::vector<uint16_t>& samples,
                           const std::function<bool(uint16_t)>& holds) {
    std::vector<uint8_t> mask(samples.size());
    std::transform(samples.begin(), samples.end(), mask.begin(),
                   [&](uint16_t label) { return uint8_t(holds(label)); });
    return mask;
}

bool any(const std::vector<uint8_t>& mask) {
    return std::any_of(mask.begin(), mask.end(), [](uint8_t m) { return m != 0; });
}

// Labels that seeds have, but for the background.
std::set<uint16_t> objects_of(const NetSeeds& seeds, const std::vector<uint16_t>& drawn,
                              const std::vector<uint16_t>& start) {
    std::set<uint16_t> labels;
    for (const auto& [label, points] : seeds.points)
        labels.insert(label);
    labels.insert(drawn.begin(), drawn.end());
    labels.insert(start.begin(), start.end());
    labels.erase(0);
    labels.erase(seeds.background);
    return labels;
}

// The hints of one object, from the start to the last scribble.
Result<void> show_object(InteractiveNet& net, uint16_t label, const NetSeeds& seeds,
                         const std::vector<uint16_t>& drawn, const std::vector<uint16_t>& start,
                         const std::stop_token& stop) {
    PALPATE_TRY(net.reset(stop));
    const auto is_label = [&](uint16_t other) { return other == label; };
    const auto is_other = [&](uint16_t other) { return other != 0 && other != label; };
    if (const std::vector<uint8_t> mask = where(start, is_label); any(mask))
        PALPATE_TRY(net.set_start(mask, stop));
    for (const bool include : {true, false}) {
        for (const auto& [of, points] : seeds.points)
            if ((of == label) == include)
                for (const glm::uvec3 at : points)
                    PALPATE_TRY(net.add_point(at, include, stop));
        const std::vector<uint8_t> scribble =
            include ? where(drawn, is_label) : where(drawn, is_other);
        if (any(scribble))
            PALPATE_TRY(net.add_scribble(scribble, include, stop));
    }
    return {};
}

Result<std::vector<uint16_t>> ask_interactive(InteractiveNet& net, const Volume& volume,
                                              const NetSeeds& seeds, const std::stop_token& stop,
                                              const std::function<void(double)>& progress) {
    const std::vector<uint16_t> drawn =
        seeds.drawn ? samples_of(*seeds.drawn) : std::vector<uint16_t>();
    const std::vector<uint16_t> start =
        seeds.start ? samples_of(*seeds.start) : std::vector<uint16_t>();
    const std::set<uint16_t> labels = objects_of(seeds, drawn, start);
    if (labels.empty())
        return fail("expected seeds of an object for the net, found none");
    PALPATE_TRY(net.set_image(volume, stop));
    std::vector<uint16_t> result(sample_count(volume.grid()));
    size_t done = 0;
    for (const uint16_t label : labels) {
        if (progress)
            progress((1.0 + double(done++)) / (1.0 + double(labels.size())));
        PALPATE_TRY(show_object(net, label, seeds, drawn, start, stop));
        for (size_t i = 0; i < result.size(); ++i)
            if (result[i] == 0 && net.mask()[i] != 0)
                result[i] = label;
    }
    return result;
}

// Refuses a label that a model has no name for: it could not be asked for.
Result<void> expect_label(const FoundNet& found, const MonaiModel& model, uint16_t label) {
    std::string known;
    for (const auto& [name, number] : model.labels) {
        if (number == label)
            return {};
        known += fmt::format("{}{} ({})", known.empty() ? "" : ", ", number, printable(name));
    }
    return fail("{}: expected seeds of the labels of the model {}, {}, found label {}",
                found.server.url, printable(model.name), known.empty() ? "(none)" : known, label);
}

Result<std::vector<uint16_t>> ask_monai(const FoundNet& found, const MonaiModel& model,
                                        const Volume& volume, const NetSeeds& seeds,
                                        const std::stop_token& stop) {
    if (seeds.drawn || seeds.start)
        return fail("{}: the model {} is shown points alone, found drawn seeds", found.server.url,
                    printable(model.name));
    std::map<uint16_t, MonaiPoints> points;
    const bool has_names = model.type == "deepedit"; // it answers with all its labels at once
    if (model.takes_points()) {
        for (const auto& [label, at] : seeds.points)
            if (label != seeds.background)
                points[label].inside = at;
        for (auto& [label, of_label] : points)
            for (const auto& [other, at] : seeds.points)
                if (other != label)
                    of_label.outside.insert(of_label.outside.end(), at.begin(), at.end());
        if (has_names)
            for (const auto& [label, of_label] : points)
                PALPATE_TRY(expect_label(found, model, label));
        if (points.empty())
            return fail("{}: expected points of an object for the model {}, found none",
                        found.server.url, printable(model.name));
    }
    PALPATE_TRY(const std::vector<Volume> maps,
                monai_infer(found.server, model, volume, points, stop));
    if (points.empty())
        return samples_of(maps[0]);
    std::vector<uint16_t> result(sample_count(volume.grid()));
    size_t next = 0;
    for (const auto& [label, of_label] : points) {
        const std::vector<uint16_t> samples = samples_of(maps[next++]);
        for (size_t i = 0; i < result.size(); ++i)
            if (result[i] == 0 && (has_names ? samples[i] == label : samples[i] != 0))
                result[i] = label;
    }
    return result;
}

} // namespace

Result<FoundNet> find_net(const NetServer& server, const std::stop_token& stop) {
    FoundNet found{server};
    int status = 0;
    const Result<HttpReply> health = ask(server, {"GET", "/healthz"}, stop, &status);
    if (!health && status == 0) // no server, or a stop
        return fail("{}", health.error().message);
    found.is_interactive = health.has_value();
    if (found.is_interactive) {
        PALPATE_TRY(found.net, InteractiveNet::connect(server, stop));
    } else {
        PALPATE_TRY(found.models, monai_models(server, stop));
    }
    return found;
}

Result<MonaiModel> model_of(const FoundNet& found, const std::string& name) {
    std::string names;
    for (const MonaiModel& model : found.models) {
        if (model.name == name || (name.empty() && found.models.size() == 1))
            return model;
        names += (names.empty() ? "" : ", ") + printable(model.name);
    }
    return fail("{}: expected one of the models {}, found {}", found.server.url,
                names.empty() ? "(none)" : names, name.empty() ? "no name" : printable(name));
}

std::string license_sentence(const FoundNet& found, const MonaiModel* model) {
    const std::string& license =
        found.is_interactive ? found.net->abilities().license : model->license;
    if (license.empty())
        return fmt::format("{} states no licence of its net: ask whoever runs it",
                           found.server.url);
    return fmt::format("the licence of the net at {} is {}", found.server.url, license);
}

std::string sending_sentence(const Volume& volume, const NetServer& server) {
    const glm::uvec3 size = volume.size();
    const bool is_encrypted = server.url.starts_with("https:");
    return fmt::format(
        "all {} x {} x {} samples of the volume, its place in the patient, the seeds, and labels "
        "to start from, go to {}, {}{}",
        size.x, size.y, size.z, server.url, is_encrypted ? "encrypted" : "not encrypted on the way",
        is_encrypted || server.key.empty() ? "" : ", where others can read the key, too");
}

Result<Volume> ask_net(const FoundNet& found, const MonaiModel* model, const Volume& volume,
                       const NetSeeds& seeds, const std::stop_token& stop,
                       const std::function<void(double share)>& progress) {
    if (progress)
        progress(0.0);
    PALPATE_TRY(const std::vector<uint16_t> labels,
                found.is_interactive ? ask_interactive(*found.net, volume, seeds, stop, progress)
                                     : ask_monai(found, *model, volume, seeds, stop));
    if (*std::max_element(labels.begin(), labels.end()) > 255)
        return make_volume<uint16_t>(volume.grid(), labels);
    const std::vector<uint8_t> bytes(labels.begin(), labels.end());
    return make_volume<uint8_t>(volume.grid(), bytes);
}

} // namespace palpate
