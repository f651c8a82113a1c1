#pragma once

#include "engine/io/decoder.h"

// One function a format. Each takes regular files and folders that exist; an error names the file.
namespace palpate::io {

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
