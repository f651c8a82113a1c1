#include "engine/decode/not_read.h"

#include <algorithm>
#include <string_view>

#include "engine/io/text_header.h"

namespace palpate::io {

namespace {

using namespace std::string_view_literals;

struct Kind {
    std::string_view name, extensions, advice; // extensions apart by spaces
};
constexpr Kind kKinds[] = {
    {"gzipped DICOM", ".dcm.gz .ima.gz .dicom.gz", "unpack it with gunzip"},
    {"GIPL", ".gipl .gipl.gz", "convert it to NIfTI, with ITK-SNAP or c3d for example"},
    {"AFNI", ".head .brik .brik.gz", "convert it to NIfTI, with 3dAFNItoNIFTI for example"},
    {"Philips PAR/REC", ".par .rec", "convert it to NIfTI, with dcm2niix or parrec2nii"},
    {"ECAT", ".v", "convert it to NIfTI, with nibabel for example"},
    {"MRtrix MIF", ".mif .mif.gz .mih", "convert it to NIfTI, with mrconvert for example"},
    {"MINC", ".mnc .mnc.gz", "convert it to NIfTI, with mnc2nii or nibabel for example"},
    {"HDF5", ".h5 .hdf5 .hdf .ims", "write its volume as NIfTI or NRRD"},
    {"NumPy", ".npy .npz", "write it as NIfTI, with nibabel for example"},
    {"MRC", ".mrc .ccp4", "convert it to NRRD or MetaImage"},
    {"GIFTI, a surface", ".gii .gii.gz", "convert it to PLY, OBJ or VTP"},
    {"bzip2", ".bz2", "unpack it first"},
    {"xz", ".xz", "unpack it first"},
    {"zstd", ".zst", "unpack it first"},
    {"a zip archive", ".zip", "unpack it first"},
    {"a 7z archive", ".7z", "unpack it first"},
    {"gzip", ".gz .tgz", "unpack it with gunzip"},
};

// Bytes that files of a kind hold, whatever they are called.
struct Mark {
    std::string_view name; // of the kind
    size_t at;
    std::string_view bytes;
};
constexpr Mark kMarks[] = {
    {"GIPL", 252, "\xef\xff\xe9\xb0"sv},
    {"GIPL", 252, "\x2a\xe3\x89\xb8"sv},
    {"AFNI", 0, "\ntype  = "sv},
    {"Philips PAR/REC", 0, "# === DATA DESCRIPTION FILE"sv},
    {"ECAT", 0, "MATRIX7"sv},
    {"MRtrix MIF", 0, "mrtrix image"sv},
    {"MINC", 0, "CDF\x01"sv},
    {"HDF5", 0, "\x89HDF\r\n"sv},
    {"NumPy", 0, "\x93NUMPY"sv},
    {"MRC", 208, "MAP "sv},
    {"bzip2", 0, "BZh"sv},
    {"xz", 0, "\xfd\x37zXZ"sv},
    {"zstd", 0, "\x28\xb5\x2f\xfd"sv},
    {"a zip archive", 0, "PK\x03\x04"sv},
    {"a 7z archive", 0, "7z\xbc\xaf"sv},
    {"gzip", 0, "\x1f\x8b"sv},
};

bool is(const Kind& kind, const FileHead& head) {
    const auto extensions = words_of(kind.extensions);
    if (std::find(extensions.begin(), extensions.end(), head.extension) != extensions.end())
        return true;
    return std::any_of(std::begin(kMarks), std::end(kMarks), [&](const Mark& mark) {
        return mark.name == kind.name && head.bytes.size() >= mark.at + mark.bytes.size() &&
               head.bytes.compare(mark.at, mark.bytes.size(), mark.bytes) == 0;
    });
}

} // namespace

std::optional<std::string> why_not_read(const FileHead& head) {
    for (const Kind& kind : kKinds)
        if (is(kind, head))
            return fmt::format("is {}, which is not read; {}", kind.name, kind.advice);
    return {};
}

} // namespace palpate::io
