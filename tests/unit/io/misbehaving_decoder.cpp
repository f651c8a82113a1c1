// Stands in for palpate as the child of load_volume(): what it does wrong is the name of the file.

#include <signal.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/decode/dicom_file.h"
#include "engine/decode/serve.h"
#include "engine/io/report.h"
#include "engine/io/sandbox.h"

using namespace palpate;
using namespace palpate::io;

#define PIXELS "_ZN7palpate2io17read_dicom_pixelsERKNS0_9DicomFileE"
Result<std::vector<char>> real_pixels(const DicomFile& file) __asm__("__real_" PIXELS);
Result<std::vector<char>> read_or_die(const DicomFile& file) __asm__("__wrap_" PIXELS);

namespace {

Decoded small_result() {
    Decoded decoded;
    decoded.grid = make_grid({2, 2, 2}, {1, 1, 1});
    return decoded;
}

VoxelClaim small_claim() {
    return {.size = {2, 2, 2}, .type = ComponentType::u8, .source_bytes = 8};
}

Result<Decoded> misbehave(const DecodeRequest& request, VoxelSink& sink) {
    const std::string what = request.path.filename().string();
    std::fprintf(stderr, "noise of a reader\n");
    std::printf("noise of a reader\n");
    std::fflush(stdout);
    if (what == "well") {
        if (auto voxels = sink.allocate("well", small_claim()); voxels)
            std::memset(voxels->data(), 7, voxels->size());
        return small_result();
    }
    if (what == "segfault")
        ::raise(SIGSEGV);
    if (what == "abort")
        std::abort();
    if (what == "terminate") {
        void (*const thrower)() = [] { throw std::runtime_error("thrown where none may be"); };
        [&]() noexcept { thrower(); }();
    }
    if (what == "exit")
        ::_exit(3);
    if (what == "spin")
        for (;;)
            ::getppid();
    if (what == "sleep")
        for (;;)
            ::pause();
    if (what == "throw")
        throw std::runtime_error("thrown by a reader");
    if (what == "greedy") { // takes memory no header justified
        std::vector<std::vector<char>> hoard;
        for (int i = 0; i < 1024; ++i)
            hoard.emplace_back(16 << 20, 'x');
    }
    if (what == "claim_too_large")
        return sink
            .allocate("claim_too_large", {.size = {100000, 100000, 100000},
                                          .type = ComponentType::f64,
                                          .source_bytes = 64,
                                          .most_expansion = 1e30})
            .map([](auto) { return small_result(); });
    if (what == "no_claim")
        return small_result();
    if (what == "crash_after_claim") {
        (void)sink.allocate(what, small_claim());
        sink.alive("slice_17.dcm");
        ::raise(SIGSEGV);
    }
    if (what == "shrinks") { // the memory is gone when the parent looks
        (void)sink.allocate(what, small_claim());
        (void)!::ftruncate(kMemoryFd, 0);
        return small_result();
    }
    if (what == "other_size") {
        (void)sink.allocate(what, small_claim());
        Decoded decoded = small_result();
        decoded.grid.size = {200, 200, 200};
        return decoded;
    }
    if (what == "flat") {
        (void)sink.allocate(what, small_claim());
        Decoded decoded = small_result();
        decoded.grid.world_from_index[2] = glm::dvec4(0);
        return decoded;
    }
    if (what == "not_finite") {
        (void)sink.allocate(what, small_claim());
        Decoded decoded = small_result();
        decoded.grid.world_from_index[3].x = 0.0 / 0.0;
        return decoded;
    }
    if (what == "babble") {
        write_report(kReportFd, "no JSON");
        ::pause();
    }
    if (what == "flood")
        for (;;)
            write_report(kReportFd, "{\"at\":\"" + std::string(1 << 16, 'x') + "\"}");
    return decode_any(request, sink);
}

} // namespace

// Stands in for read_dicom_pixels(), as the linker is told: a codec that dies of some files.
Result<std::vector<char>> read_or_die(const DicomFile& file) {
    const std::string name = file.path.filename().string();
    if (name.starts_with("aborts"))
        std::abort();
    if (name.starts_with("crashes"))
        ::raise(SIGSEGV);
    if (name.starts_with("hangs"))
        for (;;)
            ::getppid();
    return real_pixels(file);
}

int main(int argc, char** argv) {
    palpate::io::serve_decoding(argc, argv, misbehave);
}
