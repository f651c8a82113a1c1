#include "engine/io/decoder.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "engine/base/assert.h"
#include "engine/base/option_name.h"
#include "engine/io/report.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

// Bytes of the volume the parent makes from one component: 4 where f32 may be needed.
uint64_t brick_bytes(const VoxelClaim& claim) {
    const uint64_t samples = uint64_t{claim.size.x} * claim.size.y * claim.size.z;
    return samples * std::min<uint64_t>(bytes_per_component(claim.type), 4);
}

void raise_memory_limit(uint64_t bytes) {
    rlimit limit{};
    if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
        return;
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_cur + bytes, limit.rlim_max);
    ::setrlimit(RLIMIT_AS, &limit);
}

bool is_below(const fs::path& path, const fs::path& folder) {
    return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first ==
           folder.end();
}

} // namespace

const char* name_of(ComponentType type) {
    constexpr const char* names[] = {"u8",  "i8",  "u16", "i16", "u32",
                                     "i32", "u64", "i64", "f32", "f64"};
    return names[static_cast<size_t>(type)];
}

std::optional<uint64_t> claimed_bytes(const VoxelClaim& claim) {
    constexpr uint64_t most = uint64_t{1} << 62;
    uint64_t bytes = bytes_per_component(claim.type);
    for (const uint64_t factor : {uint64_t{claim.size.x}, uint64_t{claim.size.y},
                                  uint64_t{claim.size.z}, uint64_t{claim.components}}) {
        if (factor == 0 || bytes > most / factor)
            return {};
        bytes *= factor;
    }
    return bytes;
}

VoxelSink::VoxelSink(int memory_fd, int report_fd, uint64_t max_bytes)
    : memory_fd_(memory_fd), report_fd_(report_fd), max_bytes_(max_bytes) {}

VoxelSink::~VoxelSink() {
    if (!voxels_.empty())
        ::munmap(voxels_.data(), voxels_.size());
}

Result<std::span<std::byte>> VoxelSink::allocate(const std::string& name, const VoxelClaim& claim) {
    const glm::uvec3 size = claim.size;
    const std::string what =
        fmt::format("{} x {} x {} voxels of {}{}", size.x, size.y, size.z, name_of(claim.type),
                    claim.components == 1 ? "" : fmt::format(" x {}", claim.components));
    const std::optional<uint64_t> bytes = claimed_bytes(claim);
    if (!bytes)
        return fail("{}: claims {}, which is not a possible size", name, what);
    if (static_cast<double>(*bytes) > claim.most_expansion * claim.source_bytes)
        return fail("{}: claims {} ({} bytes), but holds only {} bytes{}", name, what, *bytes,
                    claim.source_bytes,
                    claim.most_expansion == kRawExpansion
                        ? ""
                        : fmt::format(", which can expand to {:.0f} at most",
                                      claim.most_expansion * claim.source_bytes));
    const uint64_t needed = *bytes + claim.working_bytes + brick_bytes(claim);
    if (needed > max_bytes_)
        return fail("{}: {} need {} bytes of memory, more than the limit of {} ({})", name, what,
                    needed, max_bytes_, Option{"max-memory"});
    raise_memory_limit(*bytes + claim.working_bytes);
    if (!voxels_.empty()) {
        ::munmap(voxels_.data(), voxels_.size());
        voxels_ = {};
    }
    if (::ftruncate(memory_fd_, 0) != 0 || // zeroes what was there
        ::ftruncate(memory_fd_, static_cast<off_t>(*bytes)) != 0)
        return fail("{}: no shared memory of {} bytes: {}", name, *bytes, std::strerror(errno));
    void* const memory = ::mmap(nullptr, *bytes, PROT_READ | PROT_WRITE, MAP_SHARED, memory_fd_, 0);
    if (memory == MAP_FAILED)
        return fail("{}: no shared memory of {} bytes: {}", name, *bytes, std::strerror(errno));
    voxels_ = {static_cast<std::byte*>(memory), *bytes};
    claim_ = claim;
    write_report(report_fd_, claim_report(claim));
    return voxels_;
}

Result<void> VoxelSink::reserve(const std::string& name, uint64_t bytes) {
    if (bytes > max_bytes_)
        return fail(
            "{}: reading it needs {} bytes of memory, more than the limit of {} "
            "({})",
            name, bytes, max_bytes_, Option{"max-memory"});
    raise_memory_limit(bytes);
    return {};
}

void VoxelSink::alive(const fs::path& file) const {
    write_report(report_fd_, alive_report(file.string()));
}

Result<uint32_t> choose_frame(const DecodeRequest& request, uint32_t frames,
                              std::vector<std::string>& warnings) {
    PALPATE_ASSERT_CMP(frames, >=, 1u);
    if (request.frame && *request.frame >= frames)
        return fail("{}: has {} frame{}, so there is no frame {} (they count from 0)",
                    request.path.string(), frames, frames == 1 ? "" : "s", *request.frame);
    if (!request.frame && frames > 1)
        warnings.push_back(fmt::format("{}: has {} frames; frame 0 is read ({} chooses)",
                                       request.path.string(), frames, Option{"frame"}));
    return request.frame.value_or(0);
}

Result<fs::path> file_beside(const fs::path& header, const std::string& name) {
    std::error_code error;
    const fs::path folder = fs::canonical(header, error).parent_path();
    if (error)
        return fail("{}: cannot be read: {}", header.string(), error.message());
    const fs::path found = fs::weakly_canonical(folder / name, error);
    if (error || !is_below(found, folder))
        return fail("{}: names the file {}, which lies outside the header's folder",
                    header.string(), name);
    if (Result<uint64_t> bytes = regular_file_bytes(found); !bytes)
        return fail("{}: names a file that cannot be used: {}", header.string(),
                    bytes.error().message);
    return found;
}

Result<uint64_t> regular_file_bytes(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status))
        return fail("{}: no such file", path.string());
    if (!fs::is_regular_file(status))
        return fail("{}: expected a regular file", path.string());
    const uint64_t bytes = fs::file_size(path, error);
    if (error || ::access(path.c_str(), R_OK) != 0)
        return fail("{}: cannot be read: {}", path.string(),
                    error ? error.message() : std::strerror(errno));
    return bytes;
}

} // namespace palpate::io
