#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/json_value.h"

namespace palpate {

struct Operation;

// Samples by the label that they have when an edit begins.
struct EditArea {
    enum class Kind : uint8_t { everywhere, inside, outside };
    Kind kind = Kind::everywhere;
    std::vector<uint16_t> labels{}; // rising, from 1 on; none: any label

    bool is_everywhere() const { return kind == Kind::everywhere; }
    bool has(uint16_t label) const;
    std::vector<bool> table() const; // has() of every label
    friend bool operator==(const EditArea&, const EditArea&) = default;
};

// Where edits of labels may change samples. All that it leaves open changes as without it; locked
// labels stay besides (Operation::spared).
struct EditMask {
    EditArea area{};
    std::optional<std::pair<double, double>> values{}; // grey, both ends included; absent: all
    // Labels whose samples may get another label, 0 for samples without one; absent: all. Taking a
    // label away overwrites nothing.
    std::optional<std::vector<uint16_t>> over{};

    bool is_open() const { return area.is_everywhere() && !values && !over; }
    friend bool operator==(const EditMask&, const EditMask&) = default;
};

// The operation within a mask as well: what both leave open. Refused: two areas, and ranges of
// values or lists of labels that have nothing in common.
Result<Operation> within_mask(Operation operation, const EditMask& mask);

// As in stroke files: "inside" or "outside" with a list of labels or "any"; "only_values" with both
// ends; "over" with a list of labels.
EditArea read_area(const JsonValue& in);
// The same from the words of an option: "any", or labels from 1 on between commas, in any order.
Result<EditArea> area_named(EditArea::Kind kind, const std::string& labels);
Result<std::vector<uint16_t>> labels_between_commas(const std::string& text, uint16_t least);
Json area_labels_json(const EditArea& area);

} // namespace palpate
