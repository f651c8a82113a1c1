#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "engine/io/volume_io.h"
#include "engine/program/interrupt.h"
#include "engine/program/named_files.h"
#include "engine/program/read_options.h"

namespace palpate {

// The options of `palpate convert` for label maps that become DICOM objects.
struct LabelOutput {
    std::string reference, reference_series, as, codes, label_names;
};

void add_label_output(CLI::App& app, LabelOutput& options);

// Whether a file's name says that it is DICOM.
bool names_dicom(const std::string& path);

// An error where the options do not go with the files.
Result<void> check_label_output(const LabelOutput& options, const std::string& in,
                                const std::string& out);

void append_label_output(const LabelOutput& options, std::vector<NamedFile>& files);

// Loads the volume, and of a structure set the labels on the grid of --reference.
Result<LoadedVolume> load_labelled(const LabelOutput& options, const ReadFlags& read, bool labels,
                                   const Interrupt& interrupt);

// Takes the names of --label-names, if any.
Result<void> take_label_names(const LabelOutput& options, LoadedVolume& labels);

// Writes the labels as a DICOM object that refers to the reference.
Result<void> convert_to_dicom(const LabelOutput& options, const ReadFlags& read,
                              const std::string& out, const LoadedVolume& labels,
                              const Interrupt& interrupt);

} // namespace palpate
