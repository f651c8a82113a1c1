#pragma once

#include <string>
#include <string_view>

#include "apps/view/window/interaction.h"

// The work that single keys do, for the table of keys (keys.cpp).
namespace palpate::view {

// A key that was pressed.
struct KeyPress {
    Outcome& next;
    const Event& event;
    const Subject& subject;
    ViewState& state;

    bool is(const char* key) const { return event.key == key; }
    bool shift() const { return event.modifiers.shift; }
    bool ctrl() const { return event.modifiers.ctrl; }
    void order(Order order) const { next.orders.push_back(std::move(order)); }
};

// The next of the values of an enum, the first one after the last.
template <class Choice>
void go_on(Choice& choice, size_t count) {
    choice = static_cast<Choice>((static_cast<size_t>(choice) + 1) % count);
}

void choose_window(const KeyPress& press);
// The volume seen along one of the patient's axes, at the distance it has now.
void look(ViewState& state, const char* from);
void page_by_key(const KeyPress& press);
void reset(const KeyPress& press);
void fade_labels(const KeyPress& press);
void resize_tool(const KeyPress& press);
// One layer of samples thicker or thinner, along the axis on which they lie nearest; at most 100.
void step_slab(const KeyPress& press);
void start_or_stop_hand(const KeyPress& press);
void take_picture(const KeyPress& press);
// Locks or unlocks the label under the pointer in a slice, else the one that is drawn.
void take_values(const KeyPress& press);
void lock_label(const KeyPress& press);
void change_label(const KeyPress& press, std::string_view id);
void export_labels(const KeyPress& press);
void undo_or_redo(const KeyPress& press);

// Why a key does nothing now, in one line; empty: it does something. `is_known`: a key of the
// table.
std::string why_idle(const KeyPress& press, bool is_known);

} // namespace palpate::view
