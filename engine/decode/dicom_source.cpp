#include "engine/decode/dicom_source.h"

#include <algorithm>
#include <array>
#include <sstream>
#include <string>

#include "engine/decode/dicom_structure.h"
#include "engine/io/byte_source.h"

namespace palpate::io {

namespace {

Result<void> append(const std::filesystem::path& path, Packing packing, uint64_t from,
                    uint64_t most_bytes, std::string& to) {
    PALPATE_TRY(ByteSource source, ByteSource::open(path, packing, from));
    std::array<char, 1 << 16> part;
    while (most_bytes > 0) {
        const auto want = static_cast<size_t>(std::min<uint64_t>(part.size(), most_bytes));
        PALPATE_TRY(const size_t got,
                    source.read(std::as_writable_bytes(std::span(part).first(want))));
        to.append(part.data(), got);
        most_bytes -= got;
        if (got < want)
            break;
    }
    return {};
}

} // namespace

Result<std::unique_ptr<std::istream>> give_file(gdcm::Reader& reader,
                                                const std::filesystem::path& path,
                                                uint64_t deflated_at, uint64_t most_bytes) {
    if (deflated_at == 0) {
        reader.SetFileName(path.c_str());
        return std::unique_ptr<std::istream>();
    }
    std::string bytes;
    PALPATE_TRY(append(path, Packing::none, 0, deflated_at, bytes));
    const std::string deflated = kDeflatedSyntax, plain = kExplicitSyntax;
    if (const size_t at = bytes.find(deflated); at != std::string::npos)
        bytes.replace(at, deflated.size(),
                      plain + std::string(deflated.size() - plain.size(), '\0'));
    PALPATE_TRY(append(path, Packing::bare_deflate, deflated_at, most_bytes, bytes));
    auto stream = std::make_unique<std::istringstream>(std::move(bytes), std::ios::binary);
    reader.SetStream(*stream);
    return std::unique_ptr<std::istream>(std::move(stream));
}

} // namespace palpate::io
