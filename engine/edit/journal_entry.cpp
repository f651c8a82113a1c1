#include <algorithm>

#include "engine/edit/journal.h"

namespace palpate {

std::string JournalEntry::text() const {
    if (kind == Kind::undo || kind == Kind::redo)
        return kind == Kind::undo ? "undo\n" : "redo\n";
    if (kind == Kind::change) {
        Json head{{"change", change.title}, {"parameters", change.parameters}};
        if (!change.is_step)
            head["step"] = false;
        if (change.move != Change::Move::none)
            head["move"] = change.move == Change::Move::back ? "back" : "forth";
        return json_line(head) + "\n" + change.packed + "\n";
    }
    Json head{{"on", on}};
    if (!guide.empty())
        head["guide"] = guide;
    return json_line(head) + "\n" + stroke_text(stroke);
}

std::string title_of(const JournalEntry& entry) {
    switch (entry.kind) {
        case JournalEntry::Kind::stroke:
            if (entry.stroke.operation.kind == OperationKind::draw)
                return fmt::format("draw {} on {}", entry.stroke.operation.label, entry.on);
            return fmt::format("{} on {}", name_of(entry.stroke.operation.kind), entry.on);
        case JournalEntry::Kind::change:
            return entry.change.title;
        case JournalEntry::Kind::undo:
            return "undo";
        case JournalEntry::Kind::redo:
            break;
    }
    return "redo";
}

Result<JournalEntry> parse_entry(std::string_view payload, const std::string& name) {
    JournalEntry entry;
    if (payload == "undo\n" || payload == "redo\n") {
        entry.kind = payload == "undo\n" ? JournalEntry::Kind::undo : JournalEntry::Kind::redo;
        return entry;
    }
    const size_t end = std::min(payload.find('\n'), payload.size() - 1);
    PALPATE_TRY(const Json head, parse_json(payload.substr(0, end), name));
    const auto text = [&](const char* key) {
        const Json* member = head.find(key);
        return member ? member->string : std::string();
    };
    const std::string_view rest = payload.substr(end + 1);
    if (head.find("change") && !rest.empty()) {
        entry.kind = JournalEntry::Kind::change;
        entry.change.title = text("change");
        if (const Json* parameters = head.find("parameters"))
            entry.change.parameters = *parameters;
        if (const Json* step = head.find("step"))
            entry.change.is_step = step->boolean;
        if (const std::string move = text("move"); move == "back" || move == "forth")
            entry.change.move = move == "back" ? Change::Move::back : Change::Move::forth;
        entry.change.packed = rest.substr(0, rest.size() - 1);
        return entry;
    }
    if (!head.find("on"))
        return fail("{}: expected a stroke, a change, undo or redo, found '{:.60}'", name,
                    payload.substr(0, end));
    entry.on = text("on");
    entry.guide = text("guide");
    PALPATE_TRY(std::vector<Stroke> strokes, parse_strokes(rest, name));
    if (strokes.size() != 1)
        return fail("{}: expected one stroke an entry, found {}", name, strokes.size());
    entry.stroke = std::move(strokes.front());
    return entry;
}

} // namespace palpate
