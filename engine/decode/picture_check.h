#pragma once

#include <filesystem>

#include "engine/base/error.h"

namespace palpate::io {

// Whether a file is a whole PNG, JPEG, TIFF or BMP, checked before a library sees it: libraries end
// the process on some damaged files, and take others for grey areas. An error names the file, the
// byte and what is wrong there.
//
// PNG: the signature; chunks within the file, IHDR first, with their checksums; IDAT that unpack to
// the pixels that IHDR claims, each row with a known filter; IEND. Source: the PNG specification,
// third edition, sections 5, 7.3, 9 and 11.
Result<void> check_png(const std::filesystem::path& path);

// JPEG: SOI; segments within the file; a frame of 8-bit samples in a process that is read
// (baseline, extended or progressive Huffman coding), before the scans; EOI. The bits of a scan are
// not decoded. Source: ITU-T T.81, annex B.
Result<void> check_jpeg(const std::filesystem::path& path);

// TIFF: the header; pages whose tags, and strips or tiles, lie within the file. What is packed in
// them is not decoded, and BigTIFF not looked into. Source: TIFF revision 6.0, section 2.
Result<void> check_tiff(const std::filesystem::path& path);

// BMP: the header; as many pixels as it claims, of 8, 24 or 32 bits, or runs of 8 bits up to their
// end mark. Source: the structures BITMAPFILEHEADER and BITMAPINFOHEADER of Windows.
Result<void> check_bmp(const std::filesystem::path& path);

} // namespace palpate::io
