#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/decode/nifti_header.h"
#include "engine/io/byte_source.h"

namespace palpate::io {

// Names and colours of labels from the XML of a NIfTI header's extension of code 30 (Caret and
// Connectome Workbench, "CaretExtension": VolumeInformation, LabelTable, Label). None where there
// is none; one that cannot be read is a warning. Label 0 and keys below it are left out.
std::vector<LabelName> nifti_label_names(const std::filesystem::path& path, Packing packing,
                                         const NiftiHeader& header,
                                         std::vector<std::string>& warnings);

} // namespace palpate::io
