#pragma once

#include <algorithm>
#include <numeric>

namespace palpate {

// Connected components of things numbered from 0: a forest in which the smallest number of a tree
// is its root. `Parents` is a container of whole numbers, such as std::vector<uint32_t> or
// std::array<uint8_t, 12>; at most as many things as its values can count.
template <class Parents>
class Forest {
 public:
    using Number = typename Parents::value_type;

    // Each thing by itself.
    explicit Forest(Parents parents = {}) : parent_(std::move(parents)) {
        std::iota(parent_.begin(), parent_.end(), Number{0});
    }

    // The smallest number connected with v. Shortens the path to it.
    Number root(Number v) {
        while (parent_[v] != v)
            v = parent_[v] = parent_[parent_[v]];
        return v;
    }
    void join(Number a, Number b) {
        a = root(a);
        b = root(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

 private:
    Parents parent_;
};

} // namespace palpate
