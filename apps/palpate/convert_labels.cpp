#include "apps/palpate/convert_labels.h"

#include <map>

#include "engine/base/log.h"
#include "engine/decode/dicom_structures.h"
#include "engine/io/dicom_structures_write.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/scene_options.h"

namespace palpate {

namespace {

const std::map<std::string, DicomLabels> kKinds{{"seg", DicomLabels::binary},
                                                {"seg-fractional", DicomLabels::fractional},
                                                {"seg-labelmap", DicomLabels::label_map}};

constexpr const char* kStructures = "rtstruct";

std::vector<std::string> kind_names() {
    std::vector<std::string> names;
    for (const auto& [name, kind] : kKinds)
        names.push_back(name);
    names.push_back(kStructures);
    return names;
}

} // namespace

void add_label_output(CLI::App& app, LabelOutput& options) {
    CLI::Option* reference =
        app.add_option("--reference", options.reference,
                       "With OUT.dcm: the DICOM series (a folder or file) to whose images, patient "
                       "and study the labels belong; their samples must be where its are. With a "
                       "structure set (RTSTRUCT) as V: the series on whose grid its contours "
                       "become labels (default: none)")
            ->type_name("SERIES");
    app.add_option("--reference-series", options.reference_series,
                   "Which one of --reference: its number in the list, its UID or a part of its "
                   "description (default: the largest)")
        ->type_name("NAME")
        ->needs(reference);
    app.add_option("--as", options.as,
                   "With OUT.dcm: seg (one bit a sample and segment), seg-fractional (one byte), "
                   "seg-labelmap (the labels themselves, of DICOM 2024) or rtstruct (contours) "
                   "(default: seg)")
        ->check(one_of(kind_names()))
        ->needs(reference);
    app.add_option("--codes", options.codes,
                   "With OUT.dcm: table of what labels are, a line each: NAME; CATEGORY; TYPE; "
                   "MODIFIER, codes as SCT|10200004|Liver (default: what Palpate knows by name, "
                   "else tissue)")
        ->type_name("FILE")
        ->needs(reference);
    app.add_option("--label-names", options.label_names,
                   "Names of the labels: a table of ITK-SNAP, 3D Slicer or FreeSurfer (default: "
                   "those in the label map's file)")
        ->type_name("FILE");
}

bool names_dicom(const std::string& path) {
    const std::string ending = std::filesystem::path(path).extension().string();
    return ending == ".dcm" || ending == ".DCM";
}

Result<void> check_label_output(const LabelOutput& options, const std::string& in,
                                const std::string& out) {
    if (names_dicom(out) && options.reference.empty())
        return fail(
            "{}: labels are written as DICOM for a series of images; name it with --reference",
            out);
    if (!names_dicom(out) && !options.reference.empty() && !io::is_structure_set(in))
        return fail(
            "--reference: expected OUT to end in .dcm, or V to be a structure set (RTSTRUCT), "
            "found "
            "'{}' and '{}'",
            out, in);
    for (const auto& [option, value] :
         {std::pair("--as", &options.as), {"--codes", &options.codes}})
        if (!names_dicom(out) && !value->empty())
            return fail("{}: expected OUT to end in .dcm, found '{}'", option, out);
    return {};
}

void append_label_output(const LabelOutput& options, std::vector<NamedFile>& files) {
    append_volume(files, "--reference", options.reference);
    files.push_back({"--codes", options.codes});
    files.push_back({"--label-names", options.label_names});
}

Result<LoadedVolume> load_labelled(const LabelOutput& options, const ReadFlags& read, bool labels,
                                   const Interrupt& interrupt) {
    if (options.reference.empty() || !io::is_structure_set(read.path))
        return load(read, labels, interrupt);
    ReadFlags flags = read;
    flags.series = options.reference_series;
    Result<LoadedVolume> loaded =
        load_structures(read.path, options.reference, read_options(flags, interrupt.token()));
    for (size_t i = 0; loaded && i < loaded->warnings.size(); ++i)
        log::warning("{}", loaded->warnings[i]);
    return loaded;
}

Result<void> take_label_names(const LabelOutput& options, LoadedVolume& labels) {
    if (!options.label_names.empty()) {
        PALPATE_TRY(labels.labels, load_label_table(options.label_names));
    }
    return {};
}

Result<void> convert_to_dicom(const LabelOutput& options, const ReadFlags& read,
                              const std::string& out, const LoadedVolume& labels,
                              const Interrupt& interrupt) {
    ReadFlags flags;
    flags.series = options.reference_series;
    flags.max_memory_mib = read.max_memory_mib;
    PALPATE_TRY(const DicomReference reference,
                load_dicom_reference(options.reference, read_options(flags, interrupt.token())));
    for (const std::string& warning : reference.warnings)
        log::warning("{}", warning);
    DicomLabelOptions how;
    const bool structures = options.as == kStructures;
    how.kind = options.as.empty() || structures ? DicomLabels::binary : kKinds.at(options.as);
    how.frame_of_reference = labels.frame_of_reference;
    how.stop = interrupt.token();
    if (!options.codes.empty()) {
        PALPATE_TRY(how.codes, SegmentCodes::load(options.codes));
    }
    PALPATE_TRY((structures ? save_dicom_structures : save_dicom_labels)(
        out, labels.volume, labels.labels, reference, how));
    tell_made(out, labels.volume);
    return {};
}

} // namespace palpate
