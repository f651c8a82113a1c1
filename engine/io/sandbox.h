#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

#include "engine/io/decoder.h"
#include "engine/io/volume_io.h"

// The parent's side of decoding in a child process.
//
// The child is the program `palpate`, run with the sub-command in serve.h. It inherits two file
// descriptors: shared memory for the voxels, and a pipe for its reports; nothing else of the
// parent's is open in it. What it prints is thrown away. It is killed when it overruns its limits,
// when it has said its last word, and when the parent dies.
namespace palpate::io {

constexpr int kMemoryFd = 3; // of the child: where it writes voxels
constexpr int kReportFd = 4; // and its report

// The voxels that a child decoded. They are mapped, not copied, and live as long as this.
struct DecodedVoxels {
    Decoded decoded;  // its grid has been checked: affine, finite, invertible
    VoxelClaim claim; // size, type and components only
    std::shared_ptr<const std::byte> memory;
    std::span<const std::byte> bytes() const {
        return {memory.get(), claimed_bytes(claim).value_or(0)};
    }
};

// The program that decodes: what was set last, where a path was; $PALPATE_DECODER if set; else
// `palpate` in the folder of the running program; in bin/ beside that folder; in bin/ of the prefix
// that a shared library with these functions lies in; in that of the prefix where CMake found
// Palpate's package; or on $PATH, in this order. Empty if there is none.
std::filesystem::path decoder_program();
// For programs that embed the library. An empty path: found as above again.
void set_decoder_program(std::filesystem::path program);

// Decodes in a child process. An error is one sentence naming the file, whatever the child did. A
// child that dies or gets nowhere in one file of several is started again without that file
// (DecodeRequest::without), up to eight times.
Result<DecodedVoxels> decode_in_child(const DecodeRequest& request, const ReadOptions& options);

} // namespace palpate::io
