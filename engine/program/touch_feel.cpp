#include "engine/program/touch_feel.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string_view>

#include "engine/base/log.h"
#include "engine/base/option_name.h"
#include "engine/edit/stroke.h"
#include "engine/io/mesh_io.h"
#include "engine/program/option_checks.h"
#include "engine/program/setting_options.h"
#include "engine/program/surface_labels.h"
#include "engine/program/touch_guide.h"
#include "engine/program/touch_texts.h"
#include "engine/volume/extent.h"
#include "haptics/field/coupling.h"
#include "haptics/field/field.h"
#include "haptics/proxy/tool_points.h"

namespace palpate {

namespace {

using haptics::LabelTouch;
using haptics::TouchSource;

constexpr double kManyGrains = 0.5; // a share of the surface

// Refuses JSON that is wrong; files are read later.
template <class T>
CLI::Validator readable_json(Result<Said<T>> (*read)(const std::string&)) {
    return readable([read](const std::string& text) -> Result<void> {
        if (!is_json(text))
            return {};
        PALPATE_TRY(read(text));
        return {};
    });
}

Result<Volume> load_component(const std::string& name, std::stop_token stop) {
    SceneFile file;
    file.volume = name;
    PALPATE_TRY(LoadedScene loaded, load_scene_data(file, {.stop = stop}));
    return std::move(loaded.data.volume);
}

// `option` names what the operation `text` and the tool are of; a drill is a ball that cuts.
struct EditTexts {
    Option option;
    const std::string &operation, &tool;
    double drill_mm = 0.0;
};
Result<std::optional<EditSetup>> read_edit(const EditTexts& o, const Feel& feel) {
    std::optional<EditSetup> edit;
    if (o.operation.empty() && o.drill_mm == 0.0)
        return edit;
    edit.emplace();
    if (o.drill_mm > 0.0) {
        edit->operation.kind = OperationKind::cut;
        edit->tool.shape = make_ball(o.drill_mm);
        edit->shape = Json{{"kind", "ball"}, {"radius_mm", o.drill_mm}};
    } else {
        Result<Said<Operation>> operation = read_touch_operation(o.operation);
        if (!operation)
            return fail("{}: {}", o.option, operation.error().message);
        edit->operation = std::move(operation->value);
    }
    if (!o.tool.empty()) {
        PALPATE_TRY(Said<Tool> tool, read_touch_tool(o.tool));
        edit->shape = std::move(tool.json);
        edit->tool = std::move(tool.value);
    }
    const bool labels = edit->operation.on_labels();
    if (labels && !feel.scene.labels)
        return fail("{}: '{}' is for labels; expected {}, or labels as SCENE", o.option,
                    name_of(edit->operation.kind), Option{"labels"});
    Result<void> possible = check(edit->operation, labels ? *feel.scene.labels : *feel.scene.grey,
                                  labels ? &*feel.scene.grey : nullptr);
    if (!possible)
        return fail("{}: {}", o.option, possible.error().message);
    edit->operation = settled(std::move(edit->operation), *feel.scene.grey);
    return edit;
}

// One line where a label map's samples lie elsewhere than the volume's.
void tell_of_places(const Volume& labels, const Volume& volume) {
    const std::string apart = apart_text("the label map", labels.grid(), volume.grid());
    if (!apart.empty())
        log::warning("{}", apart);
    else if (!check_guide(labels, volume))
        log::info(
            "the label map's samples lie elsewhere than the volume's: each is felt and changed "
            "where it lies in the patient, within {} and {} (LPS)",
            text_of(world_box(labels.grid())), text_of(world_box(volume.grid())));
}

// One line where labels are told how to feel that are nowhere.
void warn_of_absent_labels(const Feel& feel) {
    const std::map<uint16_t, uint64_t> there = count_labels(*feel.scene.labels);
    std::vector<uint32_t> absent;
    for (uint32_t i = 0; i < feel.parameters.label_count; ++i)
        if (const uint32_t label = feel.parameters.labels[i].label;
            label == 0 || !there.contains(static_cast<uint16_t>(label)))
            absent.push_back(label);
    if (!absent.empty())
        log::warning("{}: no sample has label {}", Option{"label-feel"}, fmt::join(absent, ", "));
}

// Reads an option's text by `read`; an error names the option. The command line has refused texts
// that cannot be read; Python has not.
template <class Read>
auto read_option(Option option, Read read, const std::string& text) -> decltype(read(text)) {
    auto value = read(text);
    if (!value)
        return fail("{}: {}", option, value.error().message);
    return value;
}

struct TextOption {
    const char* name;
    std::string FeelOptions::*value;
    const char* type;
    const char* help;
};
constexpr TextOption kTextOptions[] = {
    {"--transfer", &FeelOptions::transfer, "TF",
     "Haptic transfer function of wish-2008-* along the normal, N: A, or A,CENTER,WIDTH (a sigmoid "
     "of the value), or VALUE:FORCE,... (default: 0)"},
    {"--transfer-across", &FeelOptions::transfer_across, "TF", "The same across it (default: 0)"},
    {"--opacity", &FeelOptions::opacity, "TF",
     "Opacity of koerner-1999, swept-local and swept-mesh: VALUE:OPACITY,..., applied to samples "
     "before --iso (default: none)"},
    {"--mesh", &FeelOptions::mesh, "FILE",
     "Mesh of swept-mesh: .ply or .stl (default: the surface at --iso, or of all labels)"},
    {"--felt-tool", &FeelOptions::felt_tool, "JSON",
     "Tool shape of swept-tool, JSON or a JSON file, as a stroke's \"shape\" "
     "(docs/reference/strokes.md; default: a ball of --radius)"},
    {"--tool", &FeelOptions::tool, "JSON",
     "Tool shape of --edit, likewise (default: the ball of --drill)"},
    {"--second-tool", &FeelOptions::second_tool, "JSON",
     "Tool shape of --second-edit, likewise (default: --tool, or the ball of --drill)"},
    {"--second-edit", &FeelOptions::second_edit, "JSON",
     "Operation of the tool while button 1 is pressed, as of --edit and on the same data: to add "
     "what --edit removes, say (default: nothing)"},
    {"--edit", &FeelOptions::edit, "JSON",
     "Operation of the tool while button 0 is pressed: JSON or a JSON file, as a stroke's "
     "\"operation\"; cut and mill without to_value leave the volume's lowest value (default: "
     "nothing)"},
};

} // namespace

void append_files(const FeelOptions& o, std::vector<NamedFile>& files) {
    files.push_back({"--mesh", o.mesh});
    for (const std::string& component : o.field)
        files.push_back({"--field", component});
    for (const auto& [option, value] : {std::pair("--felt-tool", &o.felt_tool),
                                        {"--tool", &o.tool},
                                        {"--edit", &o.edit},
                                        {"--second-tool", &o.second_tool},
                                        {"--second-edit", &o.second_edit}})
        if (!is_json(*value))
            files.push_back({option, *value});
}

void add_feel_options(CLI::App& app, FeelOptions& o) {
    app.add_option("--source", o.source,
                   "Felt data: grey or labels (default: labels with --label-feel and while they "
                   "are edited, except by draw; else grey)")
        ->check(one_of({"grey", "labels"}));
    app.add_option("--label-feel", o.label_feel,
                   "Properties of one label: LABEL,STIFFNESS[,FRICTION[,T0]], N/m and N; "
                   "repeatable; other labels take --stiffness, --friction and --yield")
        ->check(readable(read_label))
        ->type_name("L,K,MU,T0");
    app.add_option(
           "--field", o.field,
           "Vector field of wish-2008-vector: the volumes of x, y and z (default: the gradient)")
        ->delimiter(',')
        ->expected(3)
        ->type_name("VX,VY,VZ");
    add_guide_option(app, o.guide);
    for (const TextOption& option : kTextOptions)
        app.add_option(option.name, o.*option.value, option.help)->type_name(option.type);
    for (const char* force : {"--transfer", "--transfer-across"})
        app.get_option(force)->check(readable(read_force));
    app.get_option("--opacity")->check(readable(read_opacity));
    for (const char* tool : {"--tool", "--second-tool", "--felt-tool"})
        app.get_option(tool)->check(readable_json(read_touch_tool));
    for (const char* edit : {"--edit", "--second-edit"})
        app.get_option(edit)->check(readable_json(read_touch_operation));
    add_settings<FeelOptions>(app, o, kFeelSettings);
    app.get_option("--drill")->excludes(app.get_option("--edit"));
}

Result<void> check_together(const FeelOptions& o, const std::string& algorithm) {
    if (o.label_feel.size() > haptics::TouchParameters::kMostLabels)
        return fail("{}: expected at most {}, found {}", Option{"label-feel"},
                    haptics::TouchParameters::kMostLabels, o.label_feel.size());
    const haptics::AlgorithmEntry& entry = *haptics::find_algorithm(algorithm);
    PALPATE_TRY(check_guide_felt(o.guide, entry));
    if (!o.edit.empty() && o.tool.empty())
        return fail("{}: needs a {}", Option{"edit"}, Option{"tool"});
    if (!o.second_edit.empty() && o.edit.empty() && o.drill_mm == 0.0)
        return fail("{}: needs an {} or a {} of the first button", Option{"second-edit"},
                    Option{"edit"}, Option{"drill"});
    if (!o.label_feel.empty() && entry.feels() && !entry.takes(haptics::kTakesLabels))
        return fail("{}: {} feels all labels alike; expected {} {}", Option{"label-feel"},
                    algorithm, Option{"algorithm"}, haptics::takers_text(haptics::kTakesLabels));
    if ((!o.edit.empty() || o.drill_mm > 0.0) && !o.mesh.empty())
        return fail(
            "{}: changes the volume, and swept-mesh feels the mesh of {}; leave out {} "
            "to feel the volume's own surface",
            Option{"edit"}, Option{"mesh"}, Option{"mesh"});
    return {};
}

Result<Feel> make_feel(const FeelOptions& o, const LoadedScene& loaded,
                       haptics::TouchParameters parameters,
                       const haptics::AlgorithmEntry& algorithm, std::stop_token stop) {
    Feel feel = felt_by_default(loaded);
    feel.parameters = std::move(parameters);
    PALPATE_TRY(feel.edit, read_edit({{"edit"}, o.edit, o.tool, o.drill_mm}, feel));
    const std::string& second_tool = o.second_tool.empty() ? o.tool : o.second_tool;
    PALPATE_TRY(feel.second_edit, read_edit({{"second-edit"}, o.second_edit, second_tool}, feel));
    if (feel.second_edit &&
        feel.edit->operation.on_labels() != feel.second_edit->operation.on_labels())
        return fail("{}: '{}' and {}'s '{}' change different data", Option{"second-edit"},
                    name_of(feel.second_edit->operation.kind), Option{"edit"},
                    name_of(feel.edit->operation.kind));
    if (feel.second_edit && second_tool.empty()) { // the ball of --drill
        feel.second_edit->tool = feel.edit->tool;
        feel.second_edit->shape = feel.edit->shape;
    }
    if (!o.label_feel.empty())
        feel.parameters.label_count = 0;
    for (const std::string& text : o.label_feel) {
        PALPATE_TRY(feel.parameters.labels[feel.parameters.label_count++],
                    read_option({"label-feel"}, read_label, text));
    }
    if (!o.source.empty() || feel.parameters.source == TouchSource::grey)
        feel.parameters.source = o.source.empty()       ? default_source(feel)
                                 : o.source == "labels" ? TouchSource::labels
                                                        : TouchSource::grey;
    if (feel.parameters.source == TouchSource::labels && !feel.scene.labels)
        return fail("{}: expected {}, or labels as SCENE, to feel them; found none",
                    Option{"source"}, Option{"labels"});
    if (loaded.data.labels)
        tell_of_places(*loaded.data.labels, loaded.data.volume);
    if (feel.parameters.source == TouchSource::labels && feel.parameters.label_count > 0)
        warn_of_absent_labels(feel);
    if (feel.parameters.source == TouchSource::grey && o.guide.empty()) {
        const haptics::Tuning tuning = haptics::tune(feel.parameters, *feel.scene.grey);
        if (tuning.grains > kManyGrains)
            log::warning(
                "{} {:g}: {:.0f} % of its surface belongs to grains of up to three samples, as "
                "in noise; the hand feels these grains",
                Option{"iso"}, feel.parameters.iso, 100.0 * tuning.grains);
        log::debug("normals blurred against noise by {} samples; an edge of {:.2f} samples",
                   feel.parameters.normal_blur_samples, feel.parameters.edge_samples);
    }

    if (!o.transfer.empty()) {
        PALPATE_TRY(feel.parameters.transfer[0], read_option({"transfer"}, read_force, o.transfer));
    }
    if (!o.transfer_across.empty()) {
        PALPATE_TRY(feel.parameters.transfer[1],
                    read_option({"transfer-across"}, read_force, o.transfer_across));
        feel.parameters.transfer[2] = feel.parameters.transfer[1];
    }
    if (!o.opacity.empty()) {
        PALPATE_TRY(feel.parameters.opacity, read_option({"opacity"}, read_opacity, o.opacity));
    }

    for (size_t axis = 0; axis < o.field.size(); ++axis) {
        PALPATE_TRY(feel.scene.field[axis], load_component(o.field[axis], stop));
    }
    if (!o.guide.empty()) {
        PALPATE_TRY(feel.scene.field[0], load_guide(o.guide, feel, stop));
    }
    if (algorithm.takes(haptics::kTakesTool) && !o.felt_tool.empty()) {
        PALPATE_TRY(const Said<Tool> tool, read_touch_tool(o.felt_tool));
        feel.scene.tool = std::make_shared<const haptics::ToolPoints>(
            haptics::sample_tool(*tool.value.shape, feel.parameters.tool_samples));
    }
    const bool takes_mesh = algorithm.takes(haptics::kTakesMesh);
    if (takes_mesh && !o.mesh.empty()) {
        PALPATE_TRY(LoadedMesh mesh, load_mesh(o.mesh));
        add_felt_mesh(feel, std::make_shared<const Mesh>(std::move(mesh.mesh)));
    } else if (takes_mesh) {
        add_felt_mesh(feel);
    }
    return feel;
}

} // namespace palpate
