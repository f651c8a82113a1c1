#include "tests/unit/io/dicom_codec.h"

#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>

#include <sstream>

namespace palpate::test {

std::string encoded(const std::string& file, const std::string& syntax) {
    std::istringstream in(file);
    gdcm::ImageReader reader;
    reader.SetStream(in);
    if (!reader.Read())
        return {};
    gdcm::ImageChangeTransferSyntax change;
    change.SetTransferSyntax(gdcm::TransferSyntax(gdcm::TransferSyntax::GetTSType(syntax.c_str())));
    change.SetInput(reader.GetImage());
    if (!change.Change())
        return {};
    std::ostringstream out;
    gdcm::ImageWriter writer;
    writer.SetFile(reader.GetFile());
    writer.SetImage(change.GetOutput());
    writer.SetStream(out);
    return writer.Write() ? out.str() : std::string();
}

} // namespace palpate::test
