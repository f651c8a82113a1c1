#include <exception>
#include <fstream>

#include "engine/base/option_name.h"
#include "engine/base/printable.h"
#include "engine/decode/dicom_walk.h"
#include "engine/decode/formats.h"
#include "engine/decode/not_read.h"
#include "engine/decode/picture.h"
#include "engine/decode/slice_list.h"
#include "engine/io/decoder.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

constexpr size_t kFormatHeadBytes = 1024;

bool is_folder(const FileHead& head) {
    return fs::is_directory(head.path);
}
bool is_slices(const FileHead& head) {
    return is_picture(head.extension) || is_pattern(head.path.filename().string());
}
bool is_dicom(const FileHead& head) {
    return looks_like_dicom(head.bytes, head.extension);
}
bool is_nifti(const FileHead& head) {
    return head.extension == ".nii" || head.extension == ".nii.gz" || head.extension == ".hdr" ||
           head.extension == ".hdr.gz" || head.extension == ".img" || head.extension == ".img.gz";
}
bool is_nrrd(const FileHead& head) {
    return head.bytes.starts_with("NRRD000") || head.extension == ".nrrd" ||
           head.extension == ".nhdr";
}
bool is_meta_image(const FileHead& head) {
    return head.extension == ".mha" || head.extension == ".mhd";
}
bool is_invesalius(const FileHead& head) {
    return head.extension == ".inv3";
}
bool is_vtk(const FileHead& head) {
    return head.bytes.starts_with("# vtk DataFile") || head.extension == ".vtk";
}
bool is_vti(const FileHead& head) {
    return head.extension == ".vti" || head.bytes.find("<VTKFile") != std::string::npos;
}
bool is_mgh(const FileHead& head) {
    return head.extension == ".mgz" || head.extension == ".mgh" || head.extension == ".mgh.gz";
}

bool is_not_read(const FileHead& head) {
    return why_not_read(head).has_value();
}

FileHead head_of(const fs::path& path);

// A DICOM series or slices, by what lies in the folder.
bool is_volume_file(const FileHead& head);

Result<Decoded> decode_folder(const DecodeRequest& request, VoxelSink& sink) {
    bool has_pictures = false;
    std::string volume; // the first by name
    for (const fs::directory_entry& entry : fs::directory_iterator(request.path)) {
        if (!entry.is_regular_file())
            continue;
        if (entry.path().filename() == kSidecarName)
            return decode_slices(request, sink);
        const FileHead head = head_of(entry.path());
        has_pictures = has_pictures || is_picture(head.extension);
        if (is_dicom(head))
            return decode_dicom(request, sink);
        if (const std::string name = entry.path().filename().string();
            is_volume_file(head) && (volume.empty() || name < volume))
            volume = name;
    }
    if (has_pictures)
        return decode_slices(request, sink);
    if (holds_dicom(request.path, sink))
        return decode_dicom(request, sink);
    return fail(
        "{}: expected a folder of DICOM files, of pictures (PNG, TIFF, JPEG, BMP) or of "
        "slices described by {}{}",
        request.path.string(), kSidecarName,
        volume.empty() ? ""
                       : fmt::format("; to read the volume in it, name its file: {}",
                                     (request.path / volume).string()));
}

Result<Decoded> refuse_by_name(const DecodeRequest& request, VoxelSink&) {
    return fail("{}: {}", request.path.string(), *why_not_read(head_of(request.path)));
}

// The first that recognises a file decodes it. What is told by content comes before what is told
// by name alone.
constexpr Format kFormats[] = {
    {"a folder", is_folder, decode_folder},
    {"slices", is_slices, decode_slices},
    {"DICOM", is_dicom, decode_dicom},
    {"NIfTI", is_nifti, decode_nifti},
    {"NRRD", is_nrrd, decode_nrrd},
    {"MetaImage", is_meta_image, decode_meta_image},
    {"MGH", is_mgh, decode_mgh},
    {"InVesalius", is_invesalius, decode_invesalius},
    {"VTK", is_vtk, decode_vtk},
    {"VTI", is_vti, decode_vti},
    {"a kind that is not read", is_not_read, refuse_by_name},
};

bool is_volume_file(const FileHead& head) {
    return is_nifti(head) || is_nrrd(head) || is_meta_image(head) || is_mgh(head) ||
           is_invesalius(head) || is_vtk(head) || is_vti(head) || head.extension == ".pbv";
}

std::string lower_extension(const fs::path& path) {
    const fs::path name = lower_case(path.filename().string());
    const std::string last = name.extension().string();
    return last == ".gz" ? name.stem().extension().string() + last : last;
}

FileHead head_of(const fs::path& path) {
    FileHead head{path, lower_extension(path), {}};
    if (fs::is_regular_file(path)) {
        head.bytes.resize(kFormatHeadBytes);
        std::ifstream in(path, std::ios::binary);
        in.read(head.bytes.data(), kFormatHeadBytes);
        head.bytes.resize(static_cast<size_t>(in.gcount()));
    }
    return head;
}

} // namespace

Result<Decoded> decode_any(const DecodeRequest& request, VoxelSink& sink) {
    const fs::file_status status = fs::status(request.path);
    const bool is_there = fs::exists(status);
    if (!is_there && !is_pattern(request.path.filename().string()))
        return fail("{}: no such file or folder", request.path.string());
    if (is_there && !fs::is_regular_file(status) && !fs::is_directory(status))
        return fail("{}: expected a file or folder, found a device or pipe", request.path.string());
    const FileHead head = head_of(request.path);
    for (const Format& format : kFormats) {
        if (!format.recognises(head))
            continue;
        try {
            Result<Decoded> decoded = format.decode(request, sink);
            // A message may quote line breaks from the file.
            if (!decoded)
                return fail("{}", printable(decoded.error().message));
            for (std::string& warning : decoded->warnings)
                warning = printable(warning);
            if (request.resample_slices && !decoded->heeded_resample_slices)
                decoded->warnings.push_back(
                    fmt::format("{}: {} has no effect: it is no series of DICOM images",
                                request.path.string(), Option{"resample-slices"}));
            return decoded;
        } catch (const std::exception& error) {
            return fail("{}: cannot be read as {}: {}", request.path.string(), format.name,
                        error.what());
        }
    }
    return fail("{}: is in no format that can be read", request.path.string());
}

} // namespace palpate::io
