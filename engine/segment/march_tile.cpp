#include "engine/segment/march_tile.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/segment/march_solve.h"

namespace palpate {

namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();
constexpr float kHorizon = 16.0f; // windows
// Times are sums of some hundred rounded ones: a smaller rise is not told on.
constexpr float kLeastRise = 0x1p-22f; // as a part of the time

// Times later than this may depend on a sample whose time went from `before` to `time`; one of cost
// 0 has its neighbour's time.
float first_to_ask(float before, float time) {
    return time > before ? std::nextafter(before, 0.0f) : time;
}

} // namespace

MarchTile::MarchTile(glm::dvec3 spacing_mm, glm::uvec3 position, const Brick& cost,
                     glm::uvec3 valid, std::vector<MarchNearField> near)
    : spacing_mm_(spacing_mm),
      origin_(glm::ivec3(position) * int(kBrickSide)),
      near_(std::move(near)),
      times_(size_t{kSide} * kPlane, kNever),
      flags_(size_t{kSide} * kPlane, kQueued) {
    for (int k = 0; k < 3; ++k) {
        weight1_[size_t(k)] = float(1.0 / (spacing_mm[k] * spacing_mm[k]));
        weight2_[size_t(k)] = float(2.25 / (spacing_mm[k] * spacing_mm[k]));
    }
    const auto samples = cost.samples<float>();
    for (uint32_t z = 0; z < valid.z; ++z)
        for (uint32_t y = 0; y < valid.y; ++y)
            for (uint32_t x = 0; x < valid.x; ++x)
                if (std::isfinite(samples[cost.stride() * offset_in_brick({x, y, z})]))
                    flags_[x + kMargin + kSide * (y + kMargin) + size_t{kPlane} * (z + kMargin)] =
                        0;
}

void MarchTile::start(glm::uvec3 local, float time) {
    const glm::ivec3 at = glm::ivec3(local) + kMargin;
    const size_t offset = size_t(at.x + kSide * at.y + kPlane * at.z);
    if (time >= times_[offset])
        return;
    times_[offset] = time;
    if (!(flags_[offset] & kNear)) {
        flags_[offset] = kQueued | kNear;
        near_list_.push_back(static_cast<uint16_t>(offset));
    }
    near_time_ = std::min(near_time_, time);
}

void MarchTile::wait(int at, float time) {
    uint8_t& flags = flags_[size_t(at)];
    if (!(flags & (kNear | kFar))) {
        const bool is_near = time < horizon_;
        flags |= is_near ? kNear : kFar;
        (is_near ? near_list_ : far_list_).push_back(static_cast<uint16_t>(at));
    }
    float& earliest = flags & kNear ? near_time_ : far_time_;
    earliest = std::min(earliest, time);
}

void MarchTile::touch(int at, glm::ivec3 local, float before) {
    const float time = times_[size_t(at)], earliest = first_to_ask(before, time);
    const int strides[] = {1, kSide, kPlane}, last = int(kBrickSide) - 1;
    for (const int stride : strides) {
        push(at - stride, earliest);
        push(at + stride, earliest);
    }
    for (int k = 0; k < 3; ++k) {
        const int shift = int(kBrickSide) * strides[k];
        if (local[k] < kMargin)
            outbox[size_t(2 * k)].push_back({static_cast<uint16_t>(at + shift), time});
        if (local[k] > last - kMargin)
            outbox[size_t(2 * k + 1)].push_back({static_cast<uint16_t>(at - shift), time});
    }
}

void MarchTile::take_in() {
    // A sample in the margin next to the brick has one neighbour in it.
    const int inward[] = {1, -1, kSide, -kSide, kPlane, -kPlane};
    for (size_t face = 0; face < inbox.size(); ++face) {
        for (const Told& told : inbox[face]) {
            const float before = std::exchange(times_[told.at], told.time);
            push(told.at + inward[face], first_to_ask(before, told.time));
        }
        inbox[face].clear();
    }
}

void MarchTile::open_waiting(Window window, const float* cost, uint32_t stride) {
    const auto open = [&](uint16_t at) {
        const int z = at / kPlane, y = (at - z * kPlane) / kSide, x = at - z * kPlane - y * kSide;
        const glm::ivec3 local = glm::ivec3(x, y, z) - kMargin;
        count(cost[stride * offset_in_brick(glm::uvec3(local))]);
        touch(at, local, kNever);
    };
    if (far_time_ < window.end) {
        // Brings near what the horizon now reaches.
        horizon_ = window.begin + kHorizon * (window.end - window.begin);
        far_time_ = kNever;
        size_t kept = 0;
        for (const uint16_t at : far_list_) {
            const float time = times_[at];
            if (time < horizon_) {
                flags_[at] = uint8_t((flags_[at] & ~kFar) | kNear);
                near_list_.push_back(at);
                near_time_ = std::min(near_time_, time);
            } else {
                far_list_[kept++] = at;
                far_time_ = std::min(far_time_, time);
            }
        }
        far_list_.resize(kept);
    }
    if (near_time_ < window.end) {
        near_time_ = kNever;
        size_t kept = 0;
        for (const uint16_t at : near_list_) {
            const float time = times_[at];
            if (time >= window.end) {
                near_list_[kept++] = at;
                near_time_ = std::min(near_time_, time);
                continue;
            }
            flags_[at] &= uint8_t(~kNear);
            if (time >= window.begin) // else a shorter way opened it in an earlier window
                open(at);
        }
        near_list_.resize(kept);
    }
}

template <int kOrder>
float MarchTile::solve(int at, float cost, float end) const {
    const float* t = times_.data() + at;
    const auto axis = [&](int stride, size_t k) -> MarchAxis {
        const bool low = t[-stride] <= t[stride];
        const float from = low ? t[-stride] : t[stride];
        if (!(from < end))
            return {kNever, 0.0f, 0.0f};
        if constexpr (kOrder == 2) {
            const float beyond = low ? t[-2 * stride] : t[2 * stride];
            if (beyond <= from)
                return {from, from + (from - beyond) * (1.0f / 3.0f), weight2_[k]};
        }
        return {from, from, weight1_[k]};
    };
    return march_solve(axis(1, 0), axis(kSide, 1), axis(kPlane, 2), cost);
}

const MarchNearField* MarchTile::near_field(glm::ivec3 local) const {
    const glm::dvec3 mm = glm::dvec3(origin_ + local) * spacing_mm_;
    for (const MarchNearField& field : near_) {
        const glm::dvec3 from = mm - field.center;
        if (glm::dot(from, from) < field.reach * field.reach)
            return &field;
    }
    return nullptr;
}

template <int kOrder>
float MarchTile::solve_near(int at, glm::ivec3 local, const MarchNearField& field, float cost,
                            float end) const {
    const float* t = times_.data() + at;
    const glm::dvec3 away = glm::dvec3(origin_ + local) * spacing_mm_ - field.center;
    const double distance = glm::length(away);
    const double here = field.cost * distance;
    const auto axis = [&](int stride, int k) -> MarchAxis {
        const int side = t[-stride] <= t[stride] ? -1 : 1;
        const float from = t[side * stride];
        if (!(from < end))
            return {kNever, 0.0f, 0.0f};
        const double h = spacing_mm_[k];
        const double slope = distance > 0.0 ? -side * field.cost * away[k] / distance : 0.0;
        const auto there = [&](int steps) {
            glm::dvec3 to = away;
            to[k] += side * steps * h;
            return field.cost * glm::length(to);
        };
        if constexpr (kOrder == 2) {
            const float beyond = t[2 * side * stride];
            if (beyond <= from)
                return {from,
                        float(from + (double(from) - beyond) / 3.0 + here -
                              (4.0 * there(1) - there(2)) / 3.0 - 2.0 / 3.0 * h * slope),
                        weight2_[size_t(k)]};
        }
        return {from, float(from + here - there(1) - h * slope), weight1_[size_t(k)]};
    };
    const std::array<MarchAxis, 3> axes{axis(1, 0), axis(kSide, 1), axis(kPlane, 2)};
    const float time = march_solve(axes[0], axes[1], axes[2], cost);
    // Within half a sample of a plane through the source, both neighbours across it are later. The
    // slope there is not 0 but known: the front comes straight from the source.
    double across = 0.0;
    for (int k = 0; k < 3; ++k)
        if (axes[size_t(k)].from >= time && std::abs(away[k]) < 0.500001 * spacing_mm_[k])
            across += away[k] * away[k];
    if (!(across > 0.0) || time == kNever)
        return time;
    const double share = std::sqrt(std::max(0.0, 1.0 - across / (distance * distance)));
    return march_solve(axes[0], axes[1], axes[2], float(cost * share));
}

bool MarchTile::rises(int at, float before, float& time, float end) {
    if (!(time > before * (1.0f + kLeastRise)) || time == kNever ||
        flags_[size_t(at)] >= kMostRises * kRise)
        return false;
    flags_[size_t(at)] += kRise;
    if (before < end) // it stays known
        time = std::min(time, std::nextafter(end, 0.0f));
    return time > before;
}

template <int kOrder>
void MarchTile::relax(Window window, const Brick& brick) {
    const auto samples = brick.samples<float>();
    const float* cost = samples.data();
    take_in();
    open_waiting(window, cost, brick.stride());
    while (queue_->begin != queue_->end) {
        const int at = queue_->at[queue_->begin++];
        flags_[size_t(at)] &= uint8_t(~kQueued);
        const float before = times_[size_t(at)];
        const int z = at / kPlane, y = (at - z * kPlane) / kSide, x = at - z * kPlane - y * kSide;
        const glm::ivec3 local = glm::ivec3(x, y, z) - kMargin;
        const float c = cost[brick.stride() * offset_in_brick(glm::uvec3(local))];
        const MarchNearField* field = near_.empty() ? nullptr : near_field(local);
        float time = field ? solve_near<kOrder>(at, local, *field, c, window.end)
                           : solve<kOrder>(at, c, window.end);
        if (!(time < before) && (kOrder == 1 || !rises(at, before, time, window.end)))
            continue;
        times_[size_t(at)] = time;
        if (time >= window.end) {
            wait(at, time);
            continue;
        }
        if (before >= window.end)
            count(c);
        touch(at, local, before);
    }
}

void MarchTile::run(Window window, int order, const Brick& cost) {
    known_ = 0;
    inverse_cost_ = 0.0;
    thread_local Queue queue;
    queue_ = &queue;
    order == 1 ? relax<1>(window, cost) : relax<2>(window, cost);
}

void MarchTile::copy_out(float last, float* times) const {
    for (int z = 0; z < int(kBrickSide); ++z)
        for (int y = 0; y < int(kBrickSide); ++y) {
            const float* row =
                &times_[size_t(kMargin + kSide * (y + kMargin) + kPlane * (z + kMargin))];
            for (int x = 0; x < int(kBrickSide); ++x)
                *times++ = row[x] <= last ? row[x] : std::numeric_limits<float>::quiet_NaN();
        }
}

} // namespace palpate
