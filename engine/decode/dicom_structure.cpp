#include "engine/decode/dicom_structure.h"

#include <algorithm>
#include <limits>
#include <span>
#include <string_view>

#include "engine/base/printable.h"
#include "engine/decode/header_fields.h"
#include "engine/io/byte_source.h"
#include "engine/io/decoder.h"

namespace palpate::io {

namespace {

constexpr int kMostDepth = 32;
constexpr uint64_t kMostElements = 1 << 24;
constexpr uint32_t kUndefined = 0xffffffff;
constexpr size_t kTagBytes = 4, kHeadBytes = 8;
constexpr size_t kMostUidBytes = 64;

enum class Form { explicit_little, explicit_big, implicit_little };

// A clause that says what is wrong; empty: nothing.
using Fault = std::string;

// The bytes of a data set, forward, with a look ahead.
class Input {
 public:
    Input(ByteSource source, uint64_t at) : source_(std::move(source)), at_(at) {}

    uint64_t at() const { return at_; }

    // The next bytes without passing over them; fewer at the end, or where they cannot be unpacked.
    std::string_view look(size_t count) {
        if (ahead_.size() - used_ < count) {
            ahead_.erase(0, used_);
            used_ = 0;
            const size_t before = ahead_.size();
            ahead_.resize(before + kAhead);
            const Result<size_t> got =
                source_.read(std::as_writable_bytes(std::span(ahead_)).subspan(before));
            ahead_.resize(before + got.value_or(0));
        }
        return std::string_view(ahead_).substr(used_, count);
    }
    void pass(uint64_t count) {
        const uint64_t held = std::min<uint64_t>(count, ahead_.size() - used_);
        used_ += held;
        at_ += count;
        if (count > held)
            (void)source_.skip(count - held); // past the end, look() finds nothing
    }

 private:
    static constexpr size_t kAhead = 4096;
    ByteSource source_;
    uint64_t at_;
    std::string ahead_;
    size_t used_ = 0;
};

struct Head {
    uint64_t at = 0; // the byte at which it begins
    uint16_t group = 0, number = 0;
    std::string vr; // empty: implicit
    uint32_t length = 0;
    std::string name() const {
        return fmt::format("element ({:04x},{:04x}) at byte {}", group, number, at);
    }
    bool is(uint16_t g, uint16_t n) const { return group == g && number == n; }
};

// PS3.5 7.1.2: whose length has 32 bits, and whose has 16.
constexpr std::string_view kLong = " OB OD OF OL OV OW SQ SV UC UN UR UT UV ";
constexpr std::string_view kShort =
    " AE AS AT CS DA DS DT FD FL IS LO LT PN SH SL SS ST TM UI UL US ";

bool is_one_of(std::string_view all, const std::string& vr) {
    return all.find(" " + vr + " ") != std::string_view::npos;
}

class Walk {
 public:
    Walk(Input& input, Form form) : input_(input), big_endian_(form == Form::explicit_big) {}

    // The elements up to byte `end`; those of an item without a length, up to its delimiter.
    Fault elements(uint64_t end, bool delimited, bool implicit, int depth) {
        if (depth > kMostDepth)
            return fmt::format("its sequences are nested more than {} deep at byte {}", kMostDepth,
                               input_.at());
        while (delimited || input_.at() < end) {
            // As readers do, takes up to three stray bytes at the end for padding.
            if (depth == 0 && end - input_.at() < kTagBytes)
                return {};
            Head head;
            if (Fault fault = read_head(end, implicit, head); !fault.empty())
                return fault;
            if (delimited && head.is(0xfffe, 0xe00d))
                return {};
            if (head.group == 0xfffe)
                return fmt::format("{} lies where no item begins or ends", head.name());
            if (Fault fault = value(head, end, implicit, depth); !fault.empty())
                return fault;
        }
        return {};
    }

    uint16_t pixel_element() const { return pixel_element_; }
    uint64_t pixels_at() const { return pixel_element_ == 0 ? input_.at() : pixels_at_; }

    Fault read_head(uint64_t end, bool implicit, Head& head) {
        head.at = input_.at();
        std::string_view bytes = input_.look(std::min<uint64_t>(kHeadBytes, end - head.at));
        if (bytes.size() < kHeadBytes)
            return fmt::format(
                "an element, an item or its end is due at byte {}, but {} bytes "
                "are left",
                head.at, bytes.size());
        head.group = static_cast<uint16_t>(number(bytes, 0, 2));
        head.number = static_cast<uint16_t>(number(bytes, 2, 2));
        if (++seen_ > kMostElements)
            return fmt::format("it has more than {} elements", kMostElements);
        if (implicit || head.group == 0xfffe) {
            head.length = number(bytes, 4, 4);
            input_.pass(kHeadBytes);
            return {};
        }
        head.vr = bytes.substr(4, 2);
        if (is_one_of(kShort, head.vr)) {
            head.length = number(bytes, 6, 2);
            input_.pass(kHeadBytes);
            return {};
        }
        if (!is_one_of(kLong, head.vr))
            return fmt::format("{} has the unknown representation '{}'", head.name(),
                               printable(head.vr));
        bytes = input_.look(std::min<uint64_t>(kHeadBytes + 4, end - head.at));
        if (bytes.size() < kHeadBytes + 4)
            return fmt::format("{} is cut off before its length", head.name());
        head.length = number(bytes, kHeadBytes, 4);
        input_.pass(kHeadBytes + 4);
        return {};
    }

 private:
    uint32_t number(std::string_view bytes, size_t at, size_t count) const {
        return number_of(bytes.substr(at, count), big_endian_);
    }

    Fault value(const Head& head, uint64_t end, bool implicit, int depth) {
        const bool pixels = head.is(0x7fe0, 0x0010);
        const bool any_pixels = pixels || head.is(0x7fe0, 0x0008) || head.is(0x7fe0, 0x0009);
        if (any_pixels && depth == 0) {
            pixel_element_ = head.number;
            pixels_at_ = input_.at();
        }
        const bool open = head.length == kUndefined;
        if (open) {
            if (pixels && (head.vr == "OB" || head.vr == "OW" || head.vr.empty()))
                return items(head, end, true, true, implicit, depth);
            if (!head.vr.empty() && head.vr != "SQ" && head.vr != "UN")
                return fmt::format("{} has no length and is no sequence", head.name());
            return items(head, end, true, false, implicit || head.vr == "UN", depth);
        }
        const uint64_t left = end - input_.at();
        if (head.length > left && any_pixels && depth == 0)
            return fmt::format("it is cut off: expected {} bytes of pixels, found {}", head.length,
                               left);
        if (head.length > left)
            return fmt::format("{} claims {} bytes, but {} are left{}", head.name(), head.length,
                               left, depth > 0 ? " of its item" : "");
        // Sequences of unknown representation are implicit (PS3.5 6.2.2); what is private is
        // looked at by nobody.
        const bool unknown = head.vr.empty() || head.vr == "UN";
        constexpr std::string_view item("\xfe\xff\x00\xe0", kTagBytes);
        if (head.vr == "SQ" || (unknown && !big_endian_ && head.group % 2 == 0 &&
                                head.length >= kHeadBytes && input_.look(kTagBytes) == item))
            return items(head, input_.at() + head.length, false, false, implicit || unknown, depth);
        input_.pass(head.length);
        return {};
    }

    // The items of a sequence, or of encoded pixels, up to byte `end` or to their delimiter.
    Fault items(const Head& of, uint64_t end, bool delimited, bool fragments, bool implicit,
                int depth) {
        while (delimited || input_.at() < end) {
            Head item;
            if (Fault fault = read_head(end, implicit, item); !fault.empty())
                return fmt::format("{} is cut off or has wrong lengths: {}", of.name(), fault);
            if (item.is(0xfffe, 0xe0dd) && (delimited || input_.at() == end))
                return {};
            if (!item.is(0xfffe, 0xe000))
                return fmt::format("{} holds {} where an item is due", of.name(), item.name());
            const bool open = item.length == kUndefined;
            const uint64_t left = end - input_.at();
            if (open ? fragments : item.length > left)
                return fmt::format("an item of {} at byte {} claims {} bytes, but {} are left",
                                   of.name(), item.at, item.length, left);
            if (fragments)
                input_.pass(item.length);
            else if (Fault fault = elements(open ? end : input_.at() + item.length, open, implicit,
                                            depth + 1);
                     !fault.empty())
                return fault;
        }
        return {};
    }

    Input& input_;
    bool big_endian_;
    uint64_t seen_ = 0;
    uint16_t pixel_element_ = 0;
    uint64_t pixels_at_ = 0;
};

// The beginning of the data set, and how it is written.
struct Meta {
    std::string syntax;
    bool has_preamble = false;
    uint64_t data_at = 0;
};

// The meta header is explicit little-endian, PS3.10 7.1.
Fault read_meta(Input& input, uint64_t end, Meta& meta) {
    const std::string_view start = input.look(132);
    meta.has_preamble = start.size() == 132 && start.substr(128) == "DICM";
    if (meta.has_preamble)
        input.pass(132);
    Walk walk(input, Form::explicit_little);
    while (input.look(2) == std::string_view("\2\0", 2)) {
        Head head;
        if (Fault fault = walk.read_head(end, false, head); !fault.empty())
            return fault;
        if (head.length > end - input.at())
            return fmt::format("{} claims {} bytes, but {} are left", head.name(), head.length,
                               end - input.at());
        if (head.number == 0x0010) {
            meta.syntax = input.look(std::min<size_t>(head.length, kMostUidBytes));
            meta.syntax.erase(std::min(meta.syntax.find_last_not_of(std::string_view(" \0", 2)) + 1,
                                       meta.syntax.size()));
        }
        input.pass(head.length);
    }
    meta.data_at = input.at();
    return input.at() + kHeadBytes <= end ? Fault() : "it holds no data set";
}

// How a data set without a stated syntax is written, by its first element.
Form guessed_form(std::string_view head) {
    const auto is_letter = [](char c) { return c >= 'A' && c <= 'Z'; };
    if (head.size() < 6 || !is_letter(head[4]) || !is_letter(head[5]))
        return Form::implicit_little;
    return head[0] == 0 && head[1] != 0 ? Form::explicit_big : Form::explicit_little;
}

Form form_of(const std::string& syntax) {
    if (syntax == "1.2.840.10008.1.2" || syntax == "1.2.840.113619.5.2")
        return Form::implicit_little;
    return syntax == "1.2.840.10008.1.2.2" ? Form::explicit_big : Form::explicit_little;
}

Result<Fault> walk_data(const std::filesystem::path& path, Packing packing, uint64_t start,
                        uint64_t end, Form form, DicomStructure& found) {
    PALPATE_TRY(ByteSource source, ByteSource::open(path, packing, start));
    Input input(std::move(source), packing == Packing::none ? start : 0);
    Walk walk(input, form);
    Fault fault = walk.elements(end, false, form == Form::implicit_little, 0);
    found.pixel_element = walk.pixel_element();
    found.pixels_at = walk.pixels_at();
    return fault;
}

} // namespace

Result<DicomStructure> check_structure(const std::filesystem::path& path) {
    PALPATE_TRY(const uint64_t bytes, regular_file_bytes(path));
    PALPATE_TRY(ByteSource source, ByteSource::open(path, Packing::none));
    Input input(std::move(source), 0);
    Meta meta;
    Fault fault = read_meta(input, bytes, meta);
    DicomStructure found;
    if (fault.empty()) {
        Packing packing = Packing::none;
        uint64_t end = bytes;
        if (meta.syntax == kDeflatedSyntax) { // how long it is comes from a first pass
            packing = Packing::bare_deflate;
            PALPATE_TRY(ByteSource packed, ByteSource::open(path, packing, meta.data_at));
            PALPATE_TRY(end, packed.skip(std::numeric_limits<uint64_t>::max()));
            found.deflated_at = meta.data_at;
        }
        const Form form =
            meta.syntax.empty() ? guessed_form(input.look(kHeadBytes)) : form_of(meta.syntax);
        PALPATE_TRY(fault, walk_data(path, packing, meta.data_at, end, form, found));
        if (!fault.empty() && form != Form::explicit_big) { // some name the other of the two
            const Form other =
                form == Form::implicit_little ? Form::explicit_little : Form::implicit_little;
            const Result<Fault> walked = walk_data(path, packing, meta.data_at, end, other, found);
            if (walked && walked->empty())
                fault.clear();
        }
    }
    if (!fault.empty())
        return fail("{}: is {}: {}", path.string(),
                    meta.has_preamble ? "damaged" : "no DICOM file, or a damaged one", fault);
    found.syntax = meta.syntax;
    return found;
}

} // namespace palpate::io
