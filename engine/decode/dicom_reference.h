#pragma once

#include <filesystem>
#include <map>

#include "engine/decode/dicom_file.h"

namespace palpate::io {

// The parts that an object takes over from the images of a stack. An error where the images state
// no study, or several frames of reference, or were resampled. Where they state no frame of
// reference, its UID is empty.
Result<DicomParts> reference_of(const std::string& name,
                                const std::map<std::filesystem::path, DicomFile>& files,
                                const DicomStack& stack);

} // namespace palpate::io
