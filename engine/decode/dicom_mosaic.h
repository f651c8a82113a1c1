#pragma once

#include <gdcmDataSet.h>

#include <map>
#include <span>
#include <string>
#include <vector>

#include "engine/decode/dicom_stack.h"

// Siemens mosaics: all slices of a volume as tiles of one large image.
namespace palpate::io {

// The values of a Siemens CSA header (both of its formats), by name; each trimmed. Empty where the
// bytes are no such header; what follows a damaged entry is left out. The format is not published:
// this follows NiBabel's description of it (nipy.org/nibabel/dicom/siemens_csa.html).
std::map<std::string, std::vector<std::string>> csa_values(std::span<const char> bytes);

// Whether ImageType says that the image is a mosaic.
bool is_mosaic(const gdcm::DataSet& set);

// The slices of a mosaic, in the order of its tiles. `plane` describes the image as a whole. An
// error, which begins with `name`, says what the header lacks: the number of slices, the direction
// in which they are stacked, or their spacing.
Result<std::vector<DicomFrame>> mosaic_frames(const std::string& name, const gdcm::DataSet& set,
                                              const DicomFrame& plane);

// Puts the samples of each tile one after another. `plane` is the size of the whole image and
// `tile` that of a tile, in samples; `pixels` holds the whole image.
std::vector<char> untile(std::span<const char> pixels, glm::uvec2 plane, glm::uvec2 tile,
                         size_t count, size_t bytes_per_sample);

} // namespace palpate::io
