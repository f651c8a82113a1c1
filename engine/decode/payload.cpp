#include "engine/decode/payload.h"

#include <algorithm>
#include <charconv>
#include <type_traits>

#include "engine/base/assert.h"

namespace palpate::io {

namespace {

constexpr double kMostAsciiExpansion = 4.0;    // "1 " stands for the 8 bytes of a double
constexpr uint64_t kMostSurplus = 64 << 20;    // unpacked bytes counted beyond what a header claims
constexpr uint64_t kFrameBlockBytes = 1 << 20; // of frames that are interleaved
constexpr uint64_t kShortRunBytes = 1 << 12;   // shorter runs are picked out of a block

double most_expansion(Encoding encoding) {
    switch (encoding) {
        case Encoding::raw:
            return kRawExpansion;
        case Encoding::deflate:
            return kDeflateExpansion;
        case Encoding::ascii:
            break;
    }
    return kMostAsciiExpansion;
}

VoxelClaim claim_of(const Payload& payload) {
    VoxelClaim claim;
    claim.size = payload.size;
    claim.type = payload.type;
    claim.components = payload.components;
    claim.most_expansion = most_expansion(payload.encoding);
    return claim;
}

// Bytes of all frames; absent when the product is no possible size.
std::optional<uint64_t> total_bytes(const Payload& payload) {
    const std::optional<uint64_t> one = claimed_bytes(claim_of(payload));
    if (!one || payload.frames > (uint64_t{1} << 62) / *one)
        return {};
    return *one * payload.frames;
}

std::string surplus_sentence(const Payload& payload, uint64_t found, uint64_t claimed,
                             bool at_least) {
    return fmt::format(
        "{}: holds {}{} bytes of voxels where the header claims {}; the last {} are left out, and "
        "if the picture is shifted, a skip is missing in the header",
        payload.file.string(), at_least ? "at least " : "", found, claimed, found - claimed);
}

// Reads the chosen frame of the payload, and passes over the others.
Result<void> read_frame(const Payload& payload, std::span<std::byte> out,
                        std::vector<std::string>& warnings) {
    PALPATE_TRY(VoxelStream stream, VoxelStream::open(payload));
    const uint64_t run =
        payload.run == 0 ? out.size() : payload.run * bytes_per_component(payload.type);
    const uint64_t group = run * payload.frames, before = run * payload.frame;
    PALPATE_ASSERT(out.size() % run == 0);
    // No more than a block is held, however many frames a header claims.
    if (run >= kShortRunBytes || payload.frames == 1 || group > kFrameBlockBytes) {
        for (uint64_t at = 0; at < out.size(); at += run) {
            PALPATE_TRY(stream.skip(before));
            PALPATE_TRY(stream.read(out.subspan(at, run)));
            PALPATE_TRY(stream.skip(group - before - run));
        }
        return stream.finish(warnings);
    }
    std::vector<std::byte> block(kFrameBlockBytes / group * group);
    for (uint64_t at = 0; at < out.size();) {
        const uint64_t groups = std::min(block.size() / group, (out.size() - at) / run);
        PALPATE_TRY(stream.read(std::span(block).first(groups * group)));
        for (uint64_t i = 0; i < groups; ++i, at += run)
            std::copy_n(block.begin() + static_cast<std::ptrdiff_t>(i * group + before), run,
                        out.begin() + static_cast<std::ptrdiff_t>(at));
    }
    return stream.finish(warnings);
}

} // namespace

std::string describe(const Payload& payload) {
    const std::optional<uint64_t> bytes = total_bytes(payload);
    return fmt::format(
        "{} x {} x {}{} voxels of {}{} ({} bytes)", payload.size.x, payload.size.y, payload.size.z,
        payload.frames == 1 ? "" : fmt::format(" x {}", payload.frames), name_of(payload.type),
        payload.components == 1 ? "" : fmt::format(" x {}", payload.components),
        bytes ? fmt::format("{}", *bytes) : "more than 2^62");
}

Result<uint64_t> VoxelStream::source_bytes(const Payload& payload) {
    const std::string name = payload.file.string();
    PALPATE_TRY(const uint64_t file_bytes, regular_file_bytes(payload.file));
    const std::optional<uint64_t> total = total_bytes(payload);
    if (!total)
        return fail("{}: the header claims {}, which is not a possible size", name,
                    describe(payload));
    if (payload.offset > file_bytes)
        return fail("{}: the voxels should begin at byte {}, but the file holds {} bytes", name,
                    payload.offset, file_bytes);
    const uint64_t held = file_bytes - payload.offset;
    switch (payload.encoding) {
        case Encoding::raw: {
            const uint64_t skip = payload.skip.value_or(held - std::min(held, *total));
            if (skip > held || *total > held - skip)
                return fail("{}: the header claims {}, but the file holds {} bytes of voxels", name,
                            describe(payload), held - std::min(skip, held));
            return held - skip;
        }
        case Encoding::deflate:
            if (static_cast<double>(*total) > kDeflateExpansion * static_cast<double>(held))
                return fail(
                    "{}: the header claims {}, but its {} compressed bytes can expand to {:.0f} at "
                    "most",
                    name, describe(payload), held, kDeflateExpansion * static_cast<double>(held));
            return held;
        case Encoding::ascii:
            break;
    }
    // The last number needs no separator.
    if (static_cast<double>(*total) > kMostAsciiExpansion * static_cast<double>(held + 1))
        return fail("{}: the header claims {}, but the file holds {} bytes of text", name,
                    describe(payload), held);
    return held + 1;
}

Result<VoxelStream> VoxelStream::open(const Payload& payload) {
    PALPATE_TRY(const uint64_t held, source_bytes(payload));
    const uint64_t total = total_bytes(payload).value_or(0);
    const Packing packing =
        payload.encoding == Encoding::deflate ? Packing::deflate : Packing::none;
    uint64_t skip = payload.skip.value_or(0);
    if (!payload.skip) {
        PALPATE_TRY(ByteSource counted, ByteSource::open(payload.file, packing, payload.offset));
        PALPATE_TRY(const uint64_t all, counted.skip(UINT64_MAX));
        skip = all - std::min(all, total);
    }
    PALPATE_TRY(ByteSource source, ByteSource::open(payload.file, packing, payload.offset));
    VoxelStream stream(payload, std::move(source));
    stream.total_ = total;
    if (payload.encoding == Encoding::ascii) {
        stream.text_.resize(held - 1);
        PALPATE_TRY(const size_t got,
                    stream.source_.read(std::as_writable_bytes(std::span(stream.text_))));
        stream.text_.resize(got);
        return stream;
    }
    PALPATE_TRY(const uint64_t skipped, stream.source_.skip(skip));
    if (skipped < skip)
        return stream.too_short(0);
    return stream;
}

tl::unexpected<Error> VoxelStream::too_short(uint64_t found) const {
    if (payload_.encoding == Encoding::ascii) {
        const uint64_t each = bytes_per_component(payload_.type);
        return fail("{}: expected {} numbers, found {}", payload_.file.string(), total_ / each,
                    found / each);
    }
    return fail("{}: the header claims {}, but the file holds {} bytes of voxels",
                payload_.file.string(), describe(payload_), found);
}

Result<void> VoxelStream::read(std::span<std::byte> out) {
    if (payload_.encoding == Encoding::ascii)
        return read_text(out);
    PALPATE_TRY(const size_t got, source_.read(out));
    done_ += got;
    if (got < out.size())
        return too_short(done_);
    if (payload_.big_endian)
        swap_bytes(out, bytes_per_component(payload_.type));
    return {};
}

Result<void> VoxelStream::skip(uint64_t bytes) {
    if (payload_.encoding == Encoding::ascii) {
        const uint64_t each = bytes_per_component(payload_.type);
        for (; bytes > 0; bytes -= each, done_ += each)
            if (next_word().empty())
                return too_short(done_);
        return {};
    }
    PALPATE_TRY(const uint64_t passed, source_.skip(bytes));
    done_ += passed;
    if (passed < bytes)
        return too_short(done_);
    return {};
}

// Numbers in decimal, apart by white space or commas.
std::string_view VoxelStream::next_word() {
    constexpr std::string_view separators{" \t\r\n\v\f,"};
    const size_t start = std::min(text_.find_first_not_of(separators, at_), text_.size());
    at_ = std::min(text_.find_first_of(separators, start), text_.size());
    const std::string_view word = std::string_view(text_).substr(start, at_ - start);
    return word.size() > 1 && word.front() == '+' ? word.substr(1) : word;
}

Result<void> VoxelStream::read_text(std::span<std::byte> out) {
    return visit_component(payload_.type, [&](auto t) -> Result<void> {
        using T = decltype(t);
        for (const std::span<T> numbers(reinterpret_cast<T*>(out.data()), out.size() / sizeof(T));
             T & number : numbers) {
            const std::string_view word = next_word();
            if (word.empty())
                return too_short(done_);
            const char* const end = word.data() + word.size();
            const auto [stop, problem] = std::from_chars(word.data(), end, number);
            if (problem != std::errc{} || stop != end)
                return fail(
                    "{}: expected a number that fits {}, found \"{}\"", payload_.file.string(),
                    std::is_integral_v<T> ? "the whole type" : "the type", word.substr(0, 40));
            done_ += sizeof(T);
        }
        return {};
    });
}

Result<void> VoxelStream::finish(std::vector<std::string>& warnings) {
    PALPATE_ASSERT_CMP(done_, ==, total_);
    if (payload_.encoding == Encoding::ascii) {
        const uint64_t claimed = total_ / bytes_per_component(payload_.type);
        uint64_t numbers = claimed;
        while (!next_word().empty())
            ++numbers;
        if (numbers > claimed)
            warnings.push_back(
                fmt::format("{}: holds {} numbers where the header claims {}; the last "
                            "{} are left out",
                            payload_.file.string(), numbers, claimed, numbers - claimed));
        return {};
    }
    // The end of a packed stream is unpacked too: only so is the stream known to be whole.
    PALPATE_TRY(const uint64_t more,
                source_.skip(payload_.encoding == Encoding::raw ? UINT64_MAX : kMostSurplus));
    if (more > 0 && !payload_.has_footer)
        warnings.push_back(surplus_sentence(payload_, total_ + more, total_, more == kMostSurplus));
    return {};
}

Result<void> read_payload(const Payload& payload, VoxelSink& sink,
                          std::vector<std::string>& warnings) {
    PALPATE_ASSERT(payload.frame < payload.frames);
    VoxelClaim claim = claim_of(payload);
    PALPATE_TRY(claim.source_bytes, VoxelStream::source_bytes(payload));
    if (payload.encoding == Encoding::ascii)
        claim.working_bytes = claim.source_bytes;
    PALPATE_TRY(const std::span<std::byte> voxels, sink.allocate(payload.file.string(), claim));
    return read_frame(payload, voxels, warnings);
}

namespace {

// The part that one file of a list holds, and which files hold the chosen frame.
struct Share {
    Payload part; // without its file
    size_t first = 0, count = 0;
};

Result<Share> share_of(const Payload& payload, size_t files) {
    const std::optional<uint64_t> total = total_bytes(payload);
    const uint64_t number_bytes = bytes_per_component(payload.type);
    const auto refuse = [&] {
        return fail("{}: expected voxels that {} files share evenly, found {}",
                    payload.file.string(), files, describe(payload));
    };
    if (!total || (*total / number_bytes) % files != 0)
        return refuse();
    const uint64_t frame = *total / number_bytes / payload.frames; // numbers
    uint64_t each = *total / number_bytes / files;
    Share share{payload, 0, files};
    if (payload.frames > 1 && payload.run > 0 &&
        payload.run < frame) { // interleaved: each file has numbers of all
        if (each % (payload.run * payload.frames) != 0)
            return refuse();
        each /= payload.frames;
    } else if (each <= frame) {
        if (frame % each != 0)
            return refuse();
        share.count = frame / each;
        share.first = share.count * payload.frame;
        share.part.frames = 1;
        share.part.frame = share.part.run = 0;
    } else {
        if (each % frame != 0)
            return refuse();
        share.part.frames = each / frame;
        share.part.frame = payload.frame % share.part.frames;
        share.first = payload.frame / share.part.frames;
        share.count = 1;
        each = frame;
    }
    const uint64_t slice = uint64_t{payload.size.x} * payload.size.y * payload.components;
    const uint64_t rows = each / payload.components;
    if (each % slice == 0)
        share.part.size.z = static_cast<uint32_t>(each / slice);
    else if (each % payload.components == 0 && rows <= UINT32_MAX)
        share.part.size = {rows, 1, 1};
    else
        return refuse();
    return share;
}

} // namespace

Result<void> read_file_list(const Payload& payload, const std::vector<std::filesystem::path>& files,
                            VoxelSink& sink, std::vector<std::string>& warnings) {
    PALPATE_TRY(const Share share, share_of(payload, files.size()));
    const uint64_t file_total = total_bytes(share.part).value_or(0);
    VoxelClaim claim = claim_of(payload);
    Payload part = share.part;
    for (size_t i = 0; i < share.count; ++i) {
        part.file = files[share.first + i];
        if (part.encoding == Encoding::raw) {
            PALPATE_TRY(const uint64_t bytes, regular_file_bytes(part.file));
            const uint64_t held = bytes - std::min(bytes, part.offset);
            const uint64_t skip = part.skip.value_or(held - std::min(held, file_total));
            if (held - std::min(held, skip) != file_total)
                return fail("{}: expected {} bytes of voxels, found {}", part.file.string(),
                            file_total, held - std::min(held, skip));
        }
        PALPATE_TRY(const uint64_t source, VoxelStream::source_bytes(part));
        claim.source_bytes += source;
        if (part.encoding == Encoding::ascii)
            claim.working_bytes = std::max(claim.working_bytes, source);
    }
    PALPATE_TRY(const std::span<std::byte> voxels, sink.allocate(payload.file.string(), claim));
    const size_t bytes = voxels.size() / share.count;
    for (size_t i = 0; i < share.count; ++i) {
        part.file = files[share.first + i];
        sink.alive(part.file);
        PALPATE_TRY(read_frame(part, voxels.subspan(i * bytes, bytes), warnings));
    }
    return {};
}

} // namespace palpate::io
