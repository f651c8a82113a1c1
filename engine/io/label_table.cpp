#include "engine/base/file.h"
#include "engine/io/label_names.h"
#include "engine/io/text_header.h"

namespace palpate {

namespace {

constexpr uint64_t kMostBytes = uint64_t{16} << 20;
constexpr int64_t kLastLabel = 65535;

// Three words as a colour of bytes.
std::optional<glm::dvec3> color_of(const std::vector<std::string_view>& words, size_t first) {
    if (words.size() < first + 3)
        return {};
    glm::dvec3 color;
    for (int i = 0; i < 3; ++i) {
        const std::optional<int64_t> byte = io::parse_integer(words[first + size_t(i)]);
        if (!byte || *byte < 0 || *byte > 255)
            return {};
        color[i] = double(*byte) / 255.0;
    }
    return color;
}

// A line with a name in quotes is ITK-SNAP's; nothing where it is neither kind.
std::optional<LabelName> label_of(std::string_view line) {
    const size_t open = line.find('"'), close = line.rfind('"');
    const bool quoted = open != std::string_view::npos && close > open;
    const std::vector<std::string_view> words = io::words_of(quoted ? line.substr(0, open) : line);
    if (words.size() < (quoted ? 4u : 2u))
        return {};
    const std::optional<int64_t> number = io::parse_integer(words[0]);
    if (!number || *number < 0 || *number > kLastLabel)
        return {};
    LabelName label{static_cast<uint32_t>(*number), std::string(words[1]), {}};
    label.color = color_of(words, quoted ? 1 : 2);
    if (quoted)
        label.name = line.substr(open + 1, close - open - 1);
    return quoted && !label.color ? std::nullopt : std::optional(label);
}

} // namespace

Result<std::vector<LabelName>> load_label_table(const std::filesystem::path& path) {
    PALPATE_TRY(const std::string text, load_text(path, kMostBytes));
    std::vector<LabelName> labels;
    std::string_view rest = text;
    for (size_t number = 1; !rest.empty(); ++number) {
        std::optional<std::string_view> line = io::take_line(rest);
        if (!line) // the last may lack its line end
            line = std::exchange(rest, {});
        const std::string_view words = io::trimmed(*line);
        if (words.empty() || words.front() == '#')
            continue;
        const std::optional<LabelName> label = label_of(words);
        if (!label)
            return fail(
                "{}:{}: expected a label's number and name, with a colour as bytes (3D Slicer, "
                "FreeSurfer) or as ITK-SNAP writes it, found \"{}\"",
                path.string(), number, words.substr(0, 60));
        if (label->label > 0)
            labels.push_back(*label);
    }
    return labels;
}

} // namespace palpate
