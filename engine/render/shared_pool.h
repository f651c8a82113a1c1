#pragma once

#include <memory>
#include <vector>

namespace palpate {

// Objects on the device that views share where they ask for the same.
template <class T>
class SharedPool {
 public:
    // Brings a view that holds `held`, or nothing, one that fits(object); else one that no other
    // view holds, to be changed: by make() where there is none. What it held is kept for the next.
    template <class Fits, class Make>
    void take(std::shared_ptr<T>& held, const Fits& fits, const Make& make) {
        if (held && fits(*held))
            return;
        held.reset();
        for (const std::shared_ptr<T>& one : all_)
            if (fits(*one)) {
                held = one;
                return;
            }
        for (const std::shared_ptr<T>& one : all_)
            if (one.use_count() == 1) {
                held = one;
                return;
            }
        held = all_.emplace_back(make());
    }

    // A view that held one needs none any more: what nobody holds goes.
    void drop(std::shared_ptr<T>& held) {
        if (!held)
            return;
        held.reset();
        std::erase_if(all_, [](const std::shared_ptr<T>& one) { return one.use_count() == 1; });
    }

    bool empty() const { return all_.empty(); }
    void clear() { all_.clear(); }

 private:
    std::vector<std::shared_ptr<T>> all_;
};

} // namespace palpate
