#pragma once

#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "apps/view/window/interaction.h"
#include "tests/view/bars.h"

namespace palpate::view {

// Grids as scanners give them: uneven, turned, flipped, with axes in another order.
inline Grid random_grid(std::mt19937& random) {
    std::uniform_real_distribution<double> real(-1.0, 1.0);
    glm::dmat4 m = glm::rotate(glm::dmat4(1.0), 3.0 * real(random),
                               glm::dvec3(real(random), real(random), 1.1 + real(random)));
    const glm::dvec3 spacing(0.5 + 0.4 * real(random), 1.0 + 0.4 * real(random),
                             2.0 + real(random));
    m = glm::scale(m, spacing * glm::dvec3(1.0, random() % 2 ? 1.0 : -1.0, 1.0));
    m[3] = glm::dvec4(100.0 * real(random), 100.0 * real(random), 100.0 * real(random), 1.0);
    return {glm::uvec3(20 + random() % 40, 20 + random() % 40, 5 + random() % 40), m};
}

inline Subject subject_of(const Grid& grid, glm::uvec2 size_px = {1280, 800}) {
    Subject subject;
    subject.grid = grid;
    subject.range = {-1000.0f, 3000.0f};
    subject.windows = {{-160.0, 240.0}, {-1000.0, 3000.0}};
    subject.window_names = {"one", "all"};
    ViewState& home = subject.home;
    home.size_px = with_bars(size_px);
    home.slices = slice_views(grid);
    home.camera = frame_volume(grid, {-0.45, -1.0, 0.4}, {0, 0, 1});
    home.window = {-160.0, 240.0};
    move_crosshair(home, grid, center_mm(grid));
    return subject;
}

// A hand that moves, presses and types, one event after the other.
struct TestHand {
    const Subject& subject;
    ViewState state = subject.home;
    double time_s = 1.0;
    std::vector<Order> orders{};

    void take(Event event) {
        event.time_s = time_s += 0.05;
        Outcome next = after(std::move(state), event, subject);
        state = std::move(next.state);
        orders.insert(orders.end(), next.orders.begin(), next.orders.end());
    }
    void move(glm::dvec2 to, Modifiers held = {}) {
        take({.kind = Event::Kind::move, .modifiers = held, .at_px = to});
    }
    void press(Button button, Modifiers held = {}) {
        take({.kind = Event::Kind::button, .modifiers = held, .button = button, .down = true});
    }
    void release(Button button) { take({.kind = Event::Kind::button, .button = button}); }
    void drag(glm::dvec2 from, glm::dvec2 to, Button button, Modifiers held = {}) {
        move(from, held.shift ? Modifiers{} : held);
        press(button, held);
        move(to, held);
        release(button);
        time_s += 1.0; // the next press is no double click
    }
    void key(const std::string& name, Modifiers held = {}) {
        take({.kind = Event::Kind::key, .modifiers = held, .down = true, .key = name});
        take({.kind = Event::Kind::key, .modifiers = held, .key = name});
    }
    void wheel(double notches, Modifiers held = {}) {
        take({.kind = Event::Kind::wheel, .modifiers = held, .wheel = {0.0, notches}});
    }
    // An order to the document by its place among `orders`; one of another type throws.
    template <class One>
    One given(size_t number) const {
        return std::get<One>(std::get<DocumentOrder>(orders.at(number)));
    }
    glm::dvec2 middle(Panel panel) const {
        const Box box = box_of(state, panel).value();
        return glm::floor(glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px));
    }
};

} // namespace palpate::view
