#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/view/panels/series_previews.h"

namespace palpate::view {

// A window without a file: what was opened last, and examples that the program makes itself.
struct WelcomeItem {
    std::string path, title, note;
    bool is_example = false;
};
constexpr size_t kMostWelcomed = 5; // of what was opened last
std::vector<WelcomeItem> welcome_items(const std::vector<std::string>& recent);

struct Welcome {
    std::vector<WelcomeItem> items{};
    std::unique_ptr<SeriesPreviews> pictures{}; // one an item; null: none
};

} // namespace palpate::view
