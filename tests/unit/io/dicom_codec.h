#pragma once

#include <string>

namespace palpate::test {

// The same DICOM file in another transfer syntax, encoded by GDCM. Empty where that fails.
std::string encoded(const std::string& file, const std::string& syntax);

} // namespace palpate::test
