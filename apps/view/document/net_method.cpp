#include "apps/view/document/net_method.h"

#include <cmath>
#include <limits>

#include "engine/net/ask_net.h"

namespace palpate::view {

namespace {

struct NetRun : KeptRun {
    NetServer server;
    std::string model;
};

// For each label of drawn seeds the sample of them that is nearest to their middle.
std::map<uint16_t, std::vector<glm::uvec3>> middles_of(const Volume& seeds) {
    struct Sum {
        glm::dvec3 sum{0.0};
        double count = 0.0, nearest = INFINITY;
        glm::uvec3 at{0};
    };
    std::map<uint16_t, Sum> sums;
    const auto for_each_seed = [&](const auto& visit) {
        for_each_brick(seeds, [&](glm::uvec3 position) {
            const Brick& brick = seeds.brick(position);
            if (!(brick.range().max > 0.0f))
                return;
            const glm::uvec3 valid = seeds.valid_in_brick(position);
            for (uint32_t z = 0; z < valid.z; ++z)
                for (uint32_t y = 0; y < valid.y; ++y)
                    for (uint32_t x = 0; x < valid.x; ++x)
                        if (const float label = brick.value(offset_in_brick({x, y, z})); label > 0)
                            visit(sums[uint16_t(label)],
                                  position * kBrickSide + glm::uvec3(x, y, z));
        });
    };
    for_each_seed([](Sum& sum, glm::uvec3 at) {
        sum.sum += glm::dvec3(at);
        sum.count += 1.0;
    });
    for_each_seed([](Sum& sum, glm::uvec3 at) {
        const glm::dvec3 way = glm::dvec3(at) - sum.sum / sum.count;
        if (glm::dot(way, way) < sum.nearest) {
            sum.nearest = glm::dot(way, way);
            sum.at = at;
        }
    });
    std::map<uint16_t, std::vector<glm::uvec3>> middles;
    for (const auto& [label, sum] : sums)
        middles[label] = {sum.at};
    return middles;
}

Result<Segmented> run_net(const SegmentInput& input, const ParameterValues&, const Task& task) {
    const auto* run = input.kept ? dynamic_cast<const NetRun*>(input.kept->get()) : nullptr;
    if (run == nullptr)
        return fail(
            "net: expected a server and the whole volume: `in the crop box only` is not for nets");
    NetSeeds seeds;
    seeds.background = input.background;
    PALPATE_TRY(const FoundNet found, find_net(run->server, task.stop));
    std::optional<MonaiModel> model;
    if (found.is_interactive) {
        seeds.drawn = input.seeds;
    } else {
        PALPATE_TRY(model, model_of(found, run->model));
        seeds.points = middles_of(*input.seeds);
    }
    const MonaiModel* chosen = model ? &*model : nullptr;
    PALPATE_TRY(Volume labels,
                ask_net(found, chosen, input.volume, seeds, task.stop, task.progress));
    return Segmented{std::move(labels), {}, {}, {license_sentence(found, chosen)}};
}

} // namespace

const SegmentMethod& net_method() {
    static const SegmentMethod method{
        .name = "net",
        .purpose = "A net on a server that you name finds the objects of the seeds",
        .takes_seeds = true,
        .strength = {},
        .parameters = {},
        .run = &run_net,
        .keeps_runs = true, // else segment() would take the wish away
    };
    return method;
}

const SegmentMethod* find_method_or_net(std::string_view name) {
    return name == net_method().name ? &net_method() : find_segment_method(name);
}

Result<std::shared_ptr<KeptRun>> net_run(const NetWish& wish, const Volume& volume) {
    if (wish.server.empty())
        return fail("net: name a server first");
    auto run = std::make_shared<NetRun>();
    PALPATE_TRY(run->server.url, server_url(wish.server));
    if (!wish.is_agreed())
        return fail("net: {}; tick `send` to agree", sending_sentence(volume, run->server));
    run->model = wish.model;
    return std::shared_ptr<KeptRun>(std::move(run));
}

} // namespace palpate::view
