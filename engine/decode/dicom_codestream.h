#pragma once

#include "engine/decode/dicom_file.h"

// The structure of encoded pixel data, looked through before a codec sees it: codecs crash on, or
// make up the rest of, what is cut off or says another size than the DICOM header.
namespace palpate::io {

// One item of encapsulated pixel data, without its head.
struct EncodedItem {
    uint64_t at = 0, bytes = 0; // in the file
};

// The items that follow one another, each with its length (PS3.5 A.4), up to a delimiter; the first
// is the table of offsets. An error where the file ends before, or holds something else.
Result<std::vector<EncodedItem>> encoded_items(const DicomFile& file);

// Checks markers, lengths, sizes and ends of JPEG, JPEG-LS and JPEG 2000 codestreams and of RLE
// segments, and that there are as many images as the header says; other encodings are let through.
// An error names the file and what is wrong. Returns the bits of a sample where a codestream says
// that it is signed, else 0. Empty work, and 0, for files that are not encapsulated.
Result<uint32_t> check_codestreams(const DicomFile& file);

} // namespace palpate::io
