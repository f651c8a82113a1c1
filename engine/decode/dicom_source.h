#pragma once

#include <gdcmReader.h>

#include <filesystem>
#include <istream>
#include <memory>

#include "engine/base/error.h"

namespace palpate::io {

// Names the file to a GDCM reader. GDCM goes back in its stream where a sequence without a length
// ends, which it cannot do while it inflates: a data set that is deflated from byte `deflated_at`
// on (0: none is) is inflated into memory beforehand, up to `most_bytes` of it.
//
// The reader reads from the stream that is returned, which is to outlive it; null where it opens
// the file itself.
Result<std::unique_ptr<std::istream>> give_file(gdcm::Reader& reader,
                                                const std::filesystem::path& path,
                                                uint64_t deflated_at, uint64_t most_bytes);

} // namespace palpate::io
