#include "engine/decode/payload.h"

#include <algorithm>
#include <charconv>
#include <type_traits>

#include "engine/base/assert.h"

namespace palpate::io {

namespace {

constexpr double kMostAsciiExpansion = 4.0; // "1 " stands for the 8 bytes of a double
constexpr uint64_t kMostSurplus = 64 << 20; // unpacked bytes counted beyond what a header claims

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

Result<std::span<std::byte>> read_raw(const Payload& payload, uint64_t file_bytes, uint64_t total,
                                      VoxelSink& sink, std::vector<std::string>& warnings) {
    const std::string name = payload.file.string();
    const uint64_t held = file_bytes - payload.offset;
    const uint64_t skip = payload.skip.value_or(held - std::min(held, total));
    if (skip > held || total > held - skip)
        return fail("{}: the header claims {}, but the file holds {} bytes of voxels", name,
                    describe(payload), held - std::min(skip, held));
    if (total < held - skip && !payload.has_footer)
        warnings.push_back(surplus_sentence(payload, held - skip, total, false));

    VoxelClaim claim = claim_of(payload);
    claim.source_bytes = held - skip;
    PALPATE_TRY(std::span<std::byte> voxels, sink.allocate(name, claim));
    const uint64_t start = payload.offset + skip + voxels.size() * payload.frame;
    PALPATE_TRY(ByteSource source, ByteSource::open(payload.file, Packing::none, start));
    PALPATE_TRY(const size_t got, source.read(voxels));
    if (got < voxels.size())
        return fail("{}: changed while it was read: expected {} bytes, found {}", name,
                    voxels.size(), got);
    return voxels;
}

Result<std::span<std::byte>> read_deflate(const Payload& payload, uint64_t file_bytes,
                                          uint64_t total, VoxelSink& sink,
                                          std::vector<std::string>& warnings) {
    const std::string name = payload.file.string();
    VoxelClaim claim = claim_of(payload);
    claim.source_bytes = file_bytes - payload.offset;
    if (static_cast<double>(total) > kDeflateExpansion * static_cast<double>(claim.source_bytes))
        return fail(
            "{}: the header claims {}, but its {} compressed bytes can expand to {:.0f} at "
            "most",
            name, describe(payload), claim.source_bytes,
            kDeflateExpansion * static_cast<double>(claim.source_bytes));
    uint64_t skip = payload.skip.value_or(0);
    if (!payload.skip) {
        PALPATE_TRY(ByteSource counted,
                    ByteSource::open(payload.file, Packing::deflate, payload.offset));
        PALPATE_TRY(const uint64_t held, counted.skip(UINT64_MAX));
        skip = held - std::min(held, total);
    }
    PALPATE_TRY(std::span<std::byte> voxels, sink.allocate(name, claim));
    PALPATE_TRY(ByteSource source,
                ByteSource::open(payload.file, Packing::deflate, payload.offset));

    // Every frame is unpacked, also those not wanted: only so is the stream known to be whole.
    const uint64_t before = skip + voxels.size() * payload.frame;
    const uint64_t after = total - voxels.size() * (payload.frame + 1);
    PALPATE_TRY(const uint64_t skipped, source.skip(before));
    PALPATE_TRY(const size_t got, source.read(voxels));
    PALPATE_TRY(const uint64_t passed, source.skip(after + kMostSurplus));
    const uint64_t found = skipped + got + passed;
    const uint64_t found_voxels = found - std::min(found, skip);
    if (found_voxels < total)
        return fail("{}: the header claims {}, but the file holds {} bytes of voxels", name,
                    describe(payload), found_voxels);
    if (found_voxels > total && !payload.has_footer)
        warnings.push_back(
            surplus_sentence(payload, found_voxels, total, passed == after + kMostSurplus));
    return voxels;
}

// Numbers in decimal, apart by white space or commas.
class NumberReader {
 public:
    explicit NumberReader(std::string_view text) : text_(text) {}

    std::string_view next_token() {
        const size_t start = text_.find_first_not_of(kSeparators);
        if (start == std::string_view::npos) {
            text_ = {};
            return {};
        }
        const size_t end = std::min(text_.find_first_of(kSeparators, start), text_.size());
        const std::string_view token = text_.substr(start, end - start);
        text_.remove_prefix(end);
        return token.size() > 1 && token.front() == '+' ? token.substr(1) : token;
    }

 private:
    static constexpr std::string_view kSeparators{" \t\r\n\v\f,"};
    std::string_view text_;
};

template <class T>
Result<void> parse_numbers(const std::string& name, std::string_view text, uint64_t first,
                           std::span<T> out) {
    NumberReader reader(text);
    for (uint64_t i = 0; i < first; ++i)
        reader.next_token();
    for (size_t i = 0; i < out.size(); ++i) {
        const std::string_view token = reader.next_token();
        if (token.empty())
            return fail("{}: expected {} numbers, found {}", name, first + out.size(), first + i);
        const char* const end = token.data() + token.size();
        const auto [stop, problem] = std::from_chars(token.data(), end, out[i]);
        if (problem != std::errc{} || stop != end)
            return fail("{}: expected a number that fits {}, found \"{}\"", name,
                        std::is_integral_v<T> ? "the whole type" : "the type", token.substr(0, 40));
    }
    return {};
}

Result<std::span<std::byte>> read_ascii(const Payload& payload, uint64_t file_bytes, uint64_t total,
                                        VoxelSink& sink, std::vector<std::string>& warnings) {
    const std::string name = payload.file.string();
    VoxelClaim claim = claim_of(payload);
    claim.source_bytes = file_bytes - payload.offset + 1; // the last number needs no separator
    claim.working_bytes = claim.source_bytes;
    if (static_cast<double>(total) > kMostAsciiExpansion * static_cast<double>(claim.source_bytes))
        return fail("{}: the header claims {}, but the file holds {} bytes of text", name,
                    describe(payload), claim.source_bytes - 1);
    PALPATE_TRY(std::span<std::byte> voxels, sink.allocate(name, claim));
    PALPATE_TRY(ByteSource source, ByteSource::open(payload.file, Packing::none, payload.offset));
    std::string text(claim.source_bytes - 1, '\0');
    PALPATE_TRY(const size_t got, source.read(std::as_writable_bytes(std::span(text))));
    text.resize(got);

    const uint64_t per_frame = voxels.size() / bytes_per_component(payload.type);
    Result<void> parsed = visit_component(payload.type, [&](auto t) {
        using T = decltype(t);
        return parse_numbers(name, text, per_frame * payload.frame,
                             std::span<T>(reinterpret_cast<T*>(voxels.data()), per_frame));
    });
    if (!parsed)
        return pass_on(parsed);
    NumberReader counter(text);
    uint64_t numbers = 0;
    while (!counter.next_token().empty())
        ++numbers;
    const uint64_t claimed = per_frame * payload.frames;
    if (numbers < claimed)
        return fail("{}: expected {} numbers, found {}", name, claimed, numbers);
    if (numbers > claimed)
        warnings.push_back(
            fmt::format("{}: holds {} numbers where the header claims {}; the last "
                        "{} are left out",
                        name, numbers, claimed, numbers - claimed));
    return voxels;
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

Result<void> read_payload(const Payload& payload, VoxelSink& sink,
                          std::vector<std::string>& warnings) {
    PALPATE_ASSERT(payload.frame < payload.frames);
    PALPATE_TRY(const uint64_t file_bytes, regular_file_bytes(payload.file));
    const std::optional<uint64_t> total = total_bytes(payload);
    if (!total)
        return fail("{}: the header claims {}, which is not a possible size", payload.file.string(),
                    describe(payload));
    if (payload.offset > file_bytes)
        return fail("{}: the voxels should begin at byte {}, but the file holds {} bytes",
                    payload.file.string(), payload.offset, file_bytes);
    Result<std::span<std::byte>> voxels;
    switch (payload.encoding) {
        case Encoding::raw:
            voxels = read_raw(payload, file_bytes, *total, sink, warnings);
            break;
        case Encoding::deflate:
            voxels = read_deflate(payload, file_bytes, *total, sink, warnings);
            break;
        case Encoding::ascii:
            voxels = read_ascii(payload, file_bytes, *total, sink, warnings);
            break;
    }
    if (!voxels)
        return pass_on(voxels);
    if (payload.big_endian && payload.encoding != Encoding::ascii)
        swap_bytes(*voxels, bytes_per_component(payload.type));
    return {};
}

} // namespace palpate::io
