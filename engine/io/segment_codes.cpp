#include "engine/io/segment_codes.h"

#include <algorithm>
#include <cctype>

#include "engine/base/file.h"
#include "engine/io/text_header.h"

namespace palpate {

namespace {

constexpr uint64_t kMostCodesBytes = uint64_t{4} << 20;
constexpr uint32_t kLastCodedLabel = 65535;

// The words of a name in lower case, sorted: letters and digits, and whatever is not ASCII.
std::vector<std::string> words_of_name(std::string_view name) {
    std::vector<std::string> words;
    bool goes_on = false;
    for (const char letter : name) {
        const auto byte = static_cast<unsigned char>(letter);
        const bool counts = byte >= 0x80 || std::isalnum(byte) != 0;
        if (counts && !goes_on)
            words.emplace_back();
        if (counts)
            words.back() += static_cast<char>(std::tolower(byte));
        goes_on = counts;
    }
    std::sort(words.begin(), words.end());
    return words;
}

std::string joined(const std::vector<std::string>& words) {
    std::string key;
    for (const std::string& word : words)
        key += (key.empty() ? "" : " ") + word;
    return key;
}

std::string key_of(std::string_view name) {
    return joined(words_of_name(name));
}

const io::KnownStructure* find_known(const std::string& key) {
    for (const io::KnownStructure& known : io::known_structures()) {
        std::string_view names = known.names;
        while (!names.empty()) {
            const size_t end = std::min(names.find(','), names.size());
            if (key_of(names.substr(0, end)) == key)
                return &known;
            names.remove_prefix(std::min(end + 1, names.size()));
        }
    }
    return nullptr;
}

SegmentCode code_of_known(const io::KnownStructure& known) {
    SegmentCode code;
    code.category = known.altered
                        ? DicomCode{"SCT", "49755003", "Morphologically Altered Structure"}
                        : DicomCode{"SCT", "123037004", "Anatomical Structure"};
    code.type = {"SCT", known.code, known.meaning};
    return code;
}

std::optional<SegmentCode> find_with_side(std::vector<std::string> words) {
    const DicomCode left{"SCT", "7771000", "Left"}, right{"SCT", "24028007", "Right"};
    for (const auto& [word, side] :
         {std::pair("left", &left), {"l", &left}, {"right", &right}, {"r", &right}}) {
        const auto found = std::find(words.begin(), words.end(), word);
        if (found == words.end())
            continue;
        words.erase(found);
        const io::KnownStructure* const known = find_known(joined(words));
        if (known == nullptr)
            return {};
        SegmentCode code = code_of_known(*known);
        code.modifier = *side;
        return code;
    }
    return {};
}

// "SCT|10200004|Liver".
std::optional<DicomCode> read_code(std::string_view text) {
    std::vector<std::string> parts(1);
    for (const char letter : text)
        if (letter == '|')
            parts.emplace_back();
        else
            parts.back() += letter;
    if (parts.size() != 3)
        return {};
    DicomCode code{std::string(io::trimmed(parts[0])), std::string(io::trimmed(parts[1])),
                   std::string(io::trimmed(parts[2]))};
    const auto fits = [](const std::string& part, size_t most) {
        return !part.empty() && part.size() <= most && part.find('\\') == std::string::npos;
    };
    if (!fits(code.scheme, 16) || !fits(code.value, 16) || !fits(code.meaning, 64))
        return {};
    return code;
}

} // namespace

Result<SegmentCodes> SegmentCodes::load(const std::filesystem::path& path) {
    PALPATE_TRY(const std::string text, load_text(path, kMostCodesBytes));
    SegmentCodes codes;
    std::string_view rest = text;
    for (size_t number = 1; !rest.empty(); ++number) {
        std::optional<std::string_view> line = io::take_line(rest);
        if (!line) // the last may lack its line end
            line = std::exchange(rest, {});
        std::string_view left = io::trimmed(*line);
        if (left.empty() || left.front() == '#')
            continue;
        std::vector<std::string_view> fields;
        for (size_t end = 0; end != std::string_view::npos;) {
            end = left.find(';');
            fields.push_back(io::trimmed(left.substr(0, end)));
            left.remove_prefix(end == std::string_view::npos ? left.size() : end + 1);
        }
        Line& entry = codes.lines_.emplace_back();
        entry.name = key_of(fields[0]);
        if (const auto label = io::parse_integer(fields[0]);
            label && *label >= 0 && *label <= kLastCodedLabel)
            entry.number = static_cast<uint32_t>(*label);
        const auto category = fields.size() > 2 ? read_code(fields[1]) : std::nullopt;
        const auto type = fields.size() > 2 ? read_code(fields[2]) : std::nullopt;
        if (fields.size() > 3)
            entry.code.modifier = read_code(fields[3]);
        if (entry.name.empty() || fields.size() > 4 || !category || !type ||
            (fields.size() == 4 && !entry.code.modifier))
            return fail(
                "{}:{}: expected NAME; CATEGORY; TYPE or NAME; CATEGORY; TYPE; MODIFIER with codes "
                "like SCT|10200004|Liver (16, 16 and 64 characters at most), found \"{}\"",
                path.string(), number, io::trimmed(*line).substr(0, 80));
        entry.code.category = *category;
        entry.code.type = *type;
    }
    return codes;
}

SegmentCode SegmentCodes::code_of(uint32_t label, std::string_view name) const {
    for (const Line& line : lines_)
        if (line.number == label)
            return line.code;
    const std::vector<std::string> words = words_of_name(name);
    const std::string key = joined(words);
    for (const Line& line : lines_)
        if (!key.empty() && line.name == key)
            return line.code;
    if (const io::KnownStructure* const known = find_known(key))
        return code_of_known(*known);
    return find_with_side(words).value_or(SegmentCode{});
}

} // namespace palpate
