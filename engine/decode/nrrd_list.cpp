#include "engine/decode/nrrd_list.h"

#include <bit>
#include <cstdio>
#include <sstream>

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

constexpr int64_t kMostFiles = 65536;

// Whether a pattern holds exactly one "%d" or "%0Nd", N of one or two digits, and no other "%".
bool is_number_pattern(const std::string& pattern) {
    const size_t percent = pattern.find('%');
    size_t at = percent + 1;
    while (at < pattern.size() && at <= percent + 3 && std::isdigit(pattern[at]))
        ++at;
    return percent != std::string::npos && at < pattern.size() && pattern[at] == 'd' &&
           pattern.find('%', at) == std::string::npos;
}

} // namespace

Result<std::optional<std::vector<fs::path>>> nrrd_file_list(const fs::path& header,
                                                            const std::string& data_file) {
    std::istringstream in(data_file);
    std::string pattern, rest;
    int64_t first = 0, last = 0, step = 0;
    if (!(in >> pattern >> first >> last >> step) || (in >> rest) || !is_number_pattern(pattern))
        return std::optional<std::vector<fs::path>>{};
    constexpr int64_t most = INT32_MAX;
    if (step == 0 || std::abs(first) > most || std::abs(last) > most || std::abs(step) > most ||
        (last - first) / step < 0 || (last - first) / step >= kMostFiles)
        return fail("{}: expected a range of 1 .. {} files, found \"{}\"", header.string(),
                    kMostFiles, data_file);
    std::vector<fs::path> files;
    for (int64_t i = first; step > 0 ? i <= last : i >= last; i += step) {
        std::array<char, 512> name;
        const int length =
            std::snprintf(name.data(), name.size(), pattern.c_str(), static_cast<int>(i));
        if (length < 0 || static_cast<size_t>(length) >= name.size())
            return fail("{}: expected shorter names of data files, found \"{}\"", header.string(),
                        pattern);
        PALPATE_TRY(const fs::path beside, file_beside(header, name.data()));
        files.push_back(beside);
    }
    return files;
}

Result<void> read_file_list(const Payload& payload, const std::vector<fs::path>& files,
                            VoxelSink& sink) {
    const std::string name = payload.file.string();
    VoxelClaim claim;
    claim.size = payload.size;
    claim.type = payload.type;
    claim.components = payload.components;
    claim.most_expansion = kRawExpansion;
    const std::optional<uint64_t> total = claimed_bytes(claim);
    if (!total || payload.frames != 1 || *total % files.size() != 0)
        return fail("{}: expected voxels that {} files share evenly, found {}", name, files.size(),
                    describe(payload));
    const uint64_t each = *total / files.size();
    claim.source_bytes = 0;
    for (const fs::path& file : files) {
        std::error_code error;
        const uint64_t held = fs::file_size(file, error);
        if (error)
            return fail("{}: cannot be read: {}", file.string(), error.message());
        const uint64_t skip = payload.skip.value_or(held - std::min(held, each));
        if (held - std::min(held, skip) != each)
            return fail("{}: expected {} bytes of voxels, found {}", file.string(), each,
                        held - std::min(held, skip));
        claim.source_bytes += each;
    }
    PALPATE_TRY(const std::span<std::byte> voxels, sink.allocate(name, claim));
    for (size_t i = 0; i < files.size(); ++i) {
        sink.alive(files[i]);
        const uint64_t skip = payload.skip.value_or(fs::file_size(files[i]) - each);
        PALPATE_TRY(ByteSource source, ByteSource::open(files[i], Packing::none, skip));
        PALPATE_TRY(const size_t got, source.read(voxels.subspan(i * each, each)));
        if (got < each)
            return fail("{}: changed while it was read: expected {} bytes, found {}",
                        files[i].string(), each, got);
    }
    const bool native_is_big = std::endian::native == std::endian::big;
    if (payload.big_endian != native_is_big)
        swap_bytes(voxels, bytes_per_component(payload.type));
    return {};
}

} // namespace palpate::io
