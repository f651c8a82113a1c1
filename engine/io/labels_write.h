#pragma once

#include <filesystem>
#include <span>
#include <stop_token>

#include "engine/base/error.h"
#include "engine/io/label_names.h"
#include "engine/volume/volume.h"

namespace palpate {

// As save_volume(), of a label map with names and colours of its labels where the format has a
// place for them: NIfTI as the table of labels of Connectome Workbench (extension of code 30), NRRD
// as segments of 3D Slicer. load_labels() and those programs read them. Of labels without a colour
// the tables hold the generated one.
Result<void> save_labels(const std::filesystem::path& path, const Volume& labels,
                         std::span<const LabelName> names, const std::stop_token& stop = {});

// Whether the format that a path names has such a place.
bool holds_label_names(const std::filesystem::path& path);

} // namespace palpate
