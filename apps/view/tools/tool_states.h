#pragma once

#include <any>
#include <map>
#include <typeindex>

namespace palpate::view {

// The states of tools, each of a type that its tool alone has to know. A value, which is copied and
// compared as one; a state that was never touched is equal to State{}.
class ToolStates {
 public:
    template <class State>
    State& of() {
        One& one = states_.try_emplace(typeid(State), One{State{}, is_same<State>}).first->second;
        return *std::any_cast<State>(&one.state);
    }
    template <class State>
    const State& of() const {
        static const State untouched{};
        const auto found = states_.find(typeid(State));
        return found == states_.end() ? untouched : *std::any_cast<State>(&found->second.state);
    }

    friend bool operator==(const ToolStates& a, const ToolStates& b) {
        return a.are_in(b) && b.are_in(a);
    }

 private:
    struct One {
        std::any state;
        bool (*is_same)(const std::any& state, const std::any* other); // null: an untouched one
    };
    template <class State>
    static bool is_same(const std::any& state, const std::any* other) {
        return *std::any_cast<State>(&state) == (other ? *std::any_cast<State>(other) : State{});
    }
    bool are_in(const ToolStates& other) const {
        for (const auto& [type, one] : states_) {
            const auto found = other.states_.find(type);
            if (!one.is_same(one.state,
                             found == other.states_.end() ? nullptr : &found->second.state))
                return false;
        }
        return true;
    }

    std::map<std::type_index, One> states_;
};

} // namespace palpate::view
