#include "engine/segment/simplex_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

namespace {

constexpr float kFarthest = std::numeric_limits<float>::infinity();

} // namespace

SimplexDistance::SimplexDistance(const Grid& grid) : least_(kFarthest) {
    const glm::dmat3 axes(grid.world_from_index);
    for (unsigned taken = 1; taken < 8; ++taken)
        for (unsigned low = 0; low < 8; ++low) {
            glm::dmat3 gram(1.0);
            const auto takes = [&](int i) { return (taken >> i & 1u) != 0; };
            const auto sign = [&](int i) { return (low >> i & 1u) != 0 ? -1.0 : 1.0; };
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    if (takes(i) && takes(j))
                        gram[i][j] = sign(i) * sign(j) * glm::dot(axes[i], axes[j]);
            glm::dmat3 inverse = glm::inverse(gram);
            double sum = 0.0;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) {
                    if (!(takes(i) && takes(j)))
                        inverse[i][j] = 0.0;
                    sum += inverse[i][j];
                }
            inverse_[taken][low] = glm::mat3(inverse);
            least_ = std::min(least_, float(1.0 / std::sqrt(sum)));
        }
}

SimplexDistance::Solution SimplexDistance::solve(const std::array<Neighbour, 3>& axes) const {
    unsigned present = 0, low = 0;
    glm::vec3 one(0.0f), value(0.0f);
    float base = kFarthest; // distances relative to it, so that nothing is lost
    for (unsigned i = 0; i < 3; ++i)
        if (axes[i].side != 0)
            base = std::min(base, axes[i].value);
    for (unsigned i = 0; i < 3; ++i) {
        if (axes[i].side == 0)
            continue;
        present |= 1u << i;
        low |= axes[i].side < 0 ? 1u << i : 0u;
        one[int(i)] = 1.0f;
        value[int(i)] = axes[i].value - base;
    }
    const auto with = [&](unsigned taken) -> Solution {
        const glm::mat3& inverse = inverse_[taken][low];
        const glm::vec3 f = inverse * one, v = inverse * value;
        const float a = glm::dot(one, f), b = glm::dot(one, v);
        const float root = b * b - a * (glm::dot(value, v) - 1.0f);
        if (!(root >= 0.0f))
            return {kFarthest, {}};
        const float u = (b + std::sqrt(root)) / a;
        const glm::vec3 way = u * f - v; // its parts along the edges, up to a factor
        for (int i = 0; i < 3; ++i)
            if ((taken >> i & 1u) != 0 && way[i] < 0.0f)
                return {kFarthest, {}};
        return {u, way / (way.x + way.y + way.z)};
    };
    Solution found = with(present);
    if (found.u == kFarthest)
        for (unsigned taken = 1; taken < 7; ++taken)
            if ((taken & ~present) == 0)
                if (const Solution part = with(taken); part.u < found.u)
                    found = part;
    found.u += base;
    return found;
}

} // namespace palpate
