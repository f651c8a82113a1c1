#include "engine/session/iso_list.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace palpate {
namespace {

ListedIso listed(double value, const char* name, bool shown = true) {
    return {{value, {0.5, 0.25, value / 1000.0}, 0.5}, name, shown};
}
std::vector<std::string> names_of(const IsoList& list) {
    std::vector<std::string> names;
    for (const ListedIso& one : list)
        names.push_back(one.name);
    return names;
}

TEST(IsoList, FollowsChangesThatAreMadeElsewhere) {
    const IsoList list{listed(-300, "skin"), listed(100, "organ", false), listed(300, "bone")};
    EXPECT_EQ(followed(list, shown_surfaces(list)), list);

    auto seen = shown_surfaces(list);
    seen[1].value = 450; // bone was moved
    EXPECT_EQ(names_of(followed(list, seen)), (std::vector<std::string>{"skin", "organ", "bone"}));
    EXPECT_EQ(followed(list, seen)[2].surface.value, 450);

    seen[0].value = 600; // and skin, beyond it
    EXPECT_EQ(shown_surfaces(followed(list, {seen[1], seen[0]})).size(), 2u);

    seen = shown_surfaces(list);
    seen[0].opacity = 0.9;
    EXPECT_EQ(followed(list, seen)[0].surface.opacity, 0.9);

    seen = {seen[1]}; // skin was removed
    EXPECT_EQ(names_of(followed(list, seen)), (std::vector<std::string>{"organ", "bone"}));
    seen = {{-300}, {20}, {300}}; // one was added
    EXPECT_EQ(names_of(followed(list, seen)),
              (std::vector<std::string>{"skin", "organ", "bone", ""}));
    EXPECT_EQ(followed({}, seen).size(), 3u);
}

// Whatever is done, what is shown is what the renderer takes: at most kMaxIsos of rising values,
// and the scene's own after the list has followed it.
TEST(IsoList, ShowsWhatTheRendererTakes) {
    std::mt19937 random(7);
    const auto below = [&](size_t n) { return random() % n; };
    IsoList list{listed(300, "bone")};
    for (int step = 0; step < 5000; ++step) {
        const auto seen = shown_surfaces(list);
        ASSERT_LE(seen.size(), kMaxIsos);
        for (size_t i = 1; i < seen.size(); ++i)
            ASSERT_LT(seen[i - 1].value, seen[i].value);
        const size_t at = list.empty() ? 0 : below(list.size());
        switch (below(4)) {
            case 0: {
                const size_t before = list.size();
                EXPECT_EQ(add_iso(list, listed(double(below(40)), "new")), before < kMostListed);
                break;
            }
            case 1:
                if (!list.empty())
                    list.erase(list.begin() + static_cast<ptrdiff_t>(at));
                break;
            case 2:
                if (!list.empty() && (list[at].shown || seen.size() < kMaxIsos))
                    list[at].shown = !list[at].shown;
                break;
            default: {
                auto changed = seen;
                for (IsoSurface& one : changed)
                    one.value += double(below(3));
                changed.erase(
                    std::unique(changed.begin(), changed.end(),
                                [](const auto& a, const auto& b) { return !(a.value < b.value); }),
                    changed.end());
                const auto hidden = std::count_if(list.begin(), list.end(),
                                                  [](const auto& one) { return !one.shown; });
                list = followed(std::move(list), changed);
                ASSERT_EQ(shown_surfaces(list), changed);
                ASSERT_EQ(std::count_if(list.begin(), list.end(),
                                        [](const auto& one) { return !one.shown; }),
                          hidden);
            }
        }
    }
}

} // namespace
} // namespace palpate
