#pragma once

#include "engine/io/decoder.h"

// Formats of foreign files: a table of them, and one function a format. Each takes regular files
// and folders that exist; an error names the file.
namespace palpate::io {

// The beginning of what is to be decoded, by which formats are told apart.
struct FileHead {
    std::filesystem::path path;
    std::string extension; // last one, lower case, with the dot; ".nii.gz" and the like are one
    std::string bytes;     // the first 1024, or fewer; empty for folders and patterns
};

using Decode = Result<Decoded> (*)(const DecodeRequest& request, VoxelSink& sink);

// One line of the table in engine/decode/formats.cpp; the first that recognises a file decodes it.
struct Format {
    const char* name; // "NIfTI"
    bool (*recognises)(const FileHead& head);
    Decode decode;
};

// Finds the format and decodes; an error names the file.
Result<Decoded> decode_any(const DecodeRequest& request, VoxelSink& sink);

Result<Decoded> decode_nifti(const DecodeRequest& request, VoxelSink& sink);      // 1 and 2
Result<Decoded> decode_invesalius(const DecodeRequest& request, VoxelSink& sink); // .inv3
Result<Decoded> decode_mgh(const DecodeRequest& request, VoxelSink& sink);        // FreeSurfer
Result<Decoded> decode_nrrd(const DecodeRequest& request, VoxelSink& sink);
Result<Decoded> decode_meta_image(const DecodeRequest& request, VoxelSink& sink);
Result<Decoded> decode_vtk(const DecodeRequest& request, VoxelSink& sink); // structured points
Result<Decoded> decode_vti(const DecodeRequest& request, VoxelSink& sink);
Result<Decoded> decode_dicom(const DecodeRequest& request, VoxelSink& sink);  // folder or file
Result<Decoded> decode_slices(const DecodeRequest& request, VoxelSink& sink); // pictures or raw

} // namespace palpate::io
