#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/view/window/interaction.h"
#include "haptics/proxy/algorithms.h"

// The search box (Ctrl+K): tools, keys, settings, windows and methods by their names. All that it
// finds is made from tables: tools(), key_commands(), widget_help(), touch's settings, the methods
// of segmentation and the volume's windows.
namespace palpate::view {

struct Findable {
    std::string title;  // "brush size"
    std::string kind;   // "tool", "key", "setting", "method", "window"
    std::string help;   // a sentence; may be empty
    std::string keys;   // "Ctrl+S"; empty: none
    std::string also;   // other words by which people look for it
    std::string widget; // that is shown to the person; empty: none
    std::function<void(Outcome& next, const Subject& subject)> choose;
};
// `algorithm`: of touch, whose settings are among them; null: none.
std::vector<Findable> findables(const Subject& subject, const haptics::AlgorithmEntry* algorithm);

// The places of those that have each word of a text, the best first: the title itself, words at its
// start before words within it, before other words, before words of the help. An empty text finds
// all.
std::vector<size_t> found(const std::vector<Findable>& all, const std::string& text);

} // namespace palpate::view
