#include <cmath>

#include "apps/palpate/command.h"
#include "engine/base/log.h"
#include "engine/base/printable.h"
#include "engine/io/hounsfield.h"
#include "engine/io/label_names.h"
#include "engine/measure/measure_report.h"
#include "engine/program/interrupt.h"
#include "engine/program/measure_labels.h"
#include "engine/program/option_checks.h"
#include "engine/program/option_texts.h"
#include "engine/program/output.h"
#include "engine/program/project_input.h"
#include "engine/program/read_options.h"
#include "engine/session/notes.h"
#include "engine/session/project_description.h"

namespace palpate {

namespace {

struct MeasureOptions {
    ReadFlags read;
    std::string labels, label_names, project, csv, json;
    std::vector<std::string> rulers, angles, polygons, spheres;
    uint32_t histogram = 0;
};

std::vector<NamedFile> files_of(const MeasureOptions& o) {
    std::vector<NamedFile> files;
    append_volume(files, "V", o.read.path);
    append_volume(files, "--labels", o.labels);
    files.insert(files.end(), {{"--label-names", o.label_names},
                               {"--csv", o.csv, FileUse::write_text},
                               {"--json", o.json, FileUse::write_text}});
    return files;
}

// "x,y,z,x,y,z"; a sphere: "x,y,z,radius".
Result<Measure> read_points(MeasureKind kind, const std::string& text) {
    const auto numbers = numbers_of(text, ',');
    const bool is_ball = kind == MeasureKind::sphere;
    if (!numbers || (is_ball ? numbers->size() != 4 : numbers->size() % 3 != 0))
        return fail("expected {}, found '{}'", is_ball ? "X,Y,Z,RADIUS" : "X,Y,Z of each point",
                    text);
    const std::vector<double>& n = *numbers;
    Measure made{kind, {}};
    for (size_t i = 0; i + 2 < n.size(); i += 3)
        made.points_mm.emplace_back(n[i], n[i + 1], n[i + 2]);
    if (is_ball && !(n[3] > 0.0))
        return fail("expected a radius above 0, found '{}'", text);
    if (is_ball)
        made.points_mm.push_back(made.points_mm[0] + glm::dvec3(n[3], 0.0, 0.0));
    PALPATE_TRY(check(made));
    return made;
}
Result<Measure> read_ruler(const std::string& text) {
    return read_points(MeasureKind::ruler, text);
}
Result<Measure> read_angle(const std::string& text) {
    return read_points(MeasureKind::angle, text);
}
Result<Measure> read_polygon(const std::string& text) {
    return read_points(MeasureKind::polygon, text);
}
Result<Measure> read_sphere(const std::string& text) {
    return read_points(MeasureKind::sphere, text);
}

std::string values_text(const ValueStatistics& v) {
    if (v.count == 0)
        return "";
    if (v.count == 1) // without a standard deviation
        return fmt::format("  {:g}, 1 sample", v.mean);
    return fmt::format("  {:g} +- {:g}, {:g} .. {:g}, median {:g}, {} samples", v.mean, v.sd, v.min,
                       v.max, v.median, v.count);
}

std::string text_of(const MeasureReport& report) {
    std::string text;
    for (const MeasureReport::One& one : report.measures) {
        const Measured& m = one.measured;
        text += name_of(one.measure.kind);
        if (!one.measure.name.empty())
            text += fmt::format(" {}", printable(one.measure.name));
        const auto add = [&](const std::optional<double>& value, const char* unit) {
            if (value)
                text += fmt::format("  {:g} {}", *value, unit);
        };
        add(m.length_mm, "mm");
        add(m.angle_deg, "degrees");
        add(m.radius_mm, "mm radius");
        add(m.area_mm2, "mm2");
        if (m.volume_mm3)
            add(*m.volume_mm3 / 1000.0, "ml");
        text += m.values ? values_text(*m.values) : "";
        text += m.note.empty() ? "\n" : fmt::format("  ({})\n", m.note);
    }
    for (const MeasureReport::Label& label : report.labels) {
        const LabelStatistics& s = label.statistics;
        text += fmt::format("label {}{}{}  {:g} ml, {} sample{}{}, {:g} mm2{}\n", s.label,
                            label.name.empty() ? "" : " ", printable(label.name),
                            s.volume_mm3 / 1000.0, s.count, s.count == 1 ? "" : "s",
                            values_text(s.values), label.surface.area_mm2,
                            label.surface.note.empty() ? "" : "  (" + label.surface.note + ")");
    }
    return text.empty() ? "nothing to measure: no label, and no measure was named\n" : text;
}

Result<std::vector<Measure>> measures_of(const MeasureOptions& o) {
    std::vector<Measure> all;
    const std::string project = !o.project.empty()             ? o.project
                                : Project::is_one(o.read.path) ? o.read.path
                                                               : "";
    if (!project.empty()) {
        if (!Project::is_one(project))
            return fail("--project: {}: expected the folder of a project", project);
        PALPATE_TRY(const Project::Seen seen,
                    Project::look(project)); // steps that no save has, too
        PALPATE_TRY(const Notes notes, notes_of(seen.contents.document.notes));
        all = notes.measures;
    }
    const std::pair<MeasureKind, const std::vector<std::string>*> named[] = {
        {MeasureKind::ruler, &o.rulers},
        {MeasureKind::angle, &o.angles},
        {MeasureKind::polygon, &o.polygons},
        {MeasureKind::sphere, &o.spheres}};
    for (const auto& [kind, texts] : named)
        for (const std::string& text : *texts)
            all.push_back(read_points(kind, text).value()); // the command line was checked
    return all;
}

// The labels that are named, or a project's own.
Result<std::optional<LoadedVolume>> labels_of(const MeasureOptions& o, const Interrupt& interrupt) {
    const bool is_project = Project::is_one(o.read.path);
    if (o.labels.empty() && is_project) {
        PALPATE_TRY(const ProjectDescription read,
                    read_project_description(project_folder(o.read.path)));
        if (read.labels.empty())
            return std::optional<LoadedVolume>();
    } else if (o.labels.empty()) {
        return std::optional<LoadedVolume>();
    }
    ReadFlags flags;
    flags.path = o.labels.empty() ? o.read.path : o.labels;
    flags.max_memory_mib = o.read.max_memory_mib;
    PALPATE_TRY(LoadedVolume loaded, load(flags, true, interrupt));
    return std::optional(std::move(loaded));
}

Result<void> run_measure(const MeasureOptions& o) {
    const Interrupt interrupt;
    PALPATE_TRY(std::vector<Measure> measures, measures_of(o));
    PALPATE_TRY(const LoadedVolume loaded, load(o.read, false, interrupt));
    PALPATE_TRY(std::optional<LoadedVolume> labels, labels_of(o, interrupt));
    if (!o.label_names.empty()) {
        PALPATE_TRY(std::vector<LabelName> names, load_label_table(o.label_names));
        if (labels)
            labels->labels = std::move(names);
        else
            log::warning("--label-names: without effect, because there is no label map (--labels)");
    }
    MeasureReport report;
    if (loaded.modality == "CT" && !lacks_ct_offset(loaded.modality, loaded.volume, loaded.coarser))
        report.unit = "HU";
    for (Measure& one : measures) {
        std::optional<Measured> measured = measure(one, loaded.volume, interrupt.token());
        if (!measured)
            return fail("stopped before all was measured");
        report.measures.push_back({std::move(one), std::move(*measured)});
    }
    if (labels) {
        PALPATE_TRY(report.labels,
                    measured_labels(*labels, loaded.volume, o.histogram, interrupt.token()));
        report.histogram_range = loaded.volume.range();
    }
    PALPATE_TRY(write_text(o.csv, report_csv(report)));
    if (!o.json.empty())
        return write_text(o.json, report_text(report_json(report)));
    return o.csv.empty() ? print_text(text_of(report)) : Result<void>();
}

} // namespace

Command add_measure(CLI::App& app) {
    auto o = std::make_shared<MeasureOptions>();
    add_read_flags(app, o->read);
    app.add_option("--labels", o->labels,
                   "Label map: count, volume, area, shape, values, box and centroid of each label "
                   "(default: that of a project)")
        ->type_name("FILE");
    app.add_option("--label-names", o->label_names,
                   "Names of the labels: a table of ITK-SNAP, 3D Slicer or FreeSurfer (default: "
                   "those in the label map's file)")
        ->type_name("FILE");
    app.add_option(
           "--histogram", o->histogram,
           "Labels: bins of equal width over the volume's values, in JSON and CSV (0: none)")
        ->check(CLI::Range(0, 65536))
        ->capture_default_str();
    app.add_option("--project", o->project,
                   "Project whose measures are taken (default: V, where it is one)")
        ->type_name("FOLDER");
    const auto add = [&](const char* name, std::vector<std::string>& texts, const char* purpose,
                         const char* type, Result<Measure> (*read)(const std::string&)) {
        app.add_option(name, texts, std::string(purpose) + ", mm, LPS; may be repeated")
            ->check(readable(read))
            ->type_name(type)
            ->take_all()
            ->expected(1)
            ->allow_extra_args(false);
    };
    add("--ruler", o->rulers, "Distance of two points", "X,Y,Z,X,Y,Z", read_ruler);
    add("--angle", o->angles, "Angle at the second of three points", "X,Y,Z,..", read_angle);
    add("--polygon", o->polygons, "Area and values within corners in one plane", "X,Y,Z,..",
        read_polygon);
    add("--sphere", o->spheres, "Volume and values of a ball", "X,Y,Z,RADIUS", read_sphere);
    app.add_option("--csv", o->csv, "Write a table, or - (default: text for people)")
        ->type_name("FILE");
    app.add_option("--json", o->json, "Write JSON, or - (default: text for people)")
        ->type_name("FILE");
    return {[o] { return run_measure(*o); }, [o] { return files_of(*o); }};
}

} // namespace palpate
