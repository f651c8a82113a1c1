#include "apps/palpate/segment_net.h"

#include <cmath>
#include <optional>

#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/net/ask_net.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/progress.h"

namespace palpate {

namespace {

Result<NetServer> server_of(const NetOptions& o) {
    if (o.send_to.empty())
        return fail("net: expected a server: --send-to HOST:PORT");
    NetServer server;
    PALPATE_TRY(server.url, server_url(o.send_to));
    if (!o.key_file.empty()) {
        PALPATE_TRY(const std::string text, load_text(o.key_file, 64 << 10));
        const Result<std::string> key = server_key(text);
        if (!key)
            return fail("{}: {}", o.key_file, key.error().message);
        server.key = *key;
    }
    server.limits.quiet = std::chrono::milliseconds(int64_t(std::ceil(o.timeout_s * 1000.0)));
    return server;
}

// Balls and points of a .json file are shown by their centres, drawn seeds by their samples.
Result<NetSeeds> seeds_of(const Volume& volume, const ReadFlags& read, const std::string& seeds,
                          const std::string& start, uint32_t background,
                          const Interrupt& interrupt) {
    NetSeeds made;
    made.background = uint16_t(background);
    if (!seeds.empty()) {
        PALPATE_TRY(ReadSeeds found, read_seeds(seeds, volume, read.max_memory_mib, interrupt));
        for (const SeedBall& ball : found.balls) {
            const glm::dvec3 at = glm::round(index_point(volume.grid(), ball.center_mm));
            made.points[ball.label].push_back(
                glm::uvec3(glm::clamp(at, glm::dvec3(0.0), glm::dvec3(volume.size()) - 1.0)));
        }
        if (found.balls.empty())
            made.drawn = std::move(found.map);
        if (made.background == 0)
            made.background = found.background;
    }
    if (!start.empty()) {
        PALPATE_TRY(ReadSeeds found, read_seeds(start, volume, read.max_memory_mib, interrupt));
        made.start = std::move(found.map);
    }
    return made;
}

} // namespace

void add_net_options(CLI::App& app, NetOptions& options) {
    app.add_option("--send-to", options.send_to,
                   "Server with a net, of nnInteractive or MONAI Label (net): HOST:PORT, or a URL "
                   "of http or https")
        ->type_name("SERVER");
    app.add_flag("--consent", options.consent,
                 "Agree that the volume and the seeds leave this machine for the server of "
                 "--send-to (net)");
    app.add_option("--key-file", options.key_file,
                   "File whose first line is the key that the server wants (net; default: no key)")
        ->type_name("FILE");
    app.add_option("--model", options.model,
                   "Model of MONAI Label (net; default: the only one there is)")
        ->type_name("NAME");
    app.add_option("--net-timeout", options.timeout_s,
                   "Silence after which a server is given up, in s, and at least 600 s while it "
                   "takes in a volume (net; default: 60)")
        ->check(within(0.1, 86400.0))
        ->type_name("S");
}

std::string net_list_text() {
    return "net  A net on a server that --send-to names, by the protocol of nnInteractive or MONAI "
           "Label\n";
}

Result<void> run_net(const NetOptions& o, const ReadFlags& read, const std::string& seeds,
                     const std::string& start, uint32_t background, const std::string& out) {
    PALPATE_TRY(expect_volume_name(out));
    PALPATE_TRY(const NetServer server, server_of(o));
    const Interrupt interrupt;
    PALPATE_TRY(const LoadedVolume loaded, load(read, false, interrupt));
    const Volume& volume = loaded.volume;
    const std::string sending = sending_sentence(volume, server);
    if (!o.consent)
        return fail("net: {}; give --consent to agree", sending);
    PALPATE_TRY(const NetSeeds shown, seeds_of(volume, read, seeds, start, background, interrupt));
    PALPATE_TRY(const FoundNet found, find_net(server, interrupt.token()));
    std::optional<MonaiModel> model;
    if (!found.is_interactive) {
        PALPATE_TRY(model, model_of(found, o.model));
    } else if (!o.model.empty()) {
        log::warning("--model changes nothing: the server has one net");
    }
    log::info("{}", license_sentence(found, model ? &*model : nullptr));
    log::info("{}", sending);
    std::optional<Progress> progress("net");
    PALPATE_TRY(const Volume labels,
                ask_net(found, model ? &*model : nullptr, volume, shown, interrupt.token(),
                        [&](double share) { progress->show(share); }));
    progress.reset();
    if (!(labels.range().max > 0.0f))
        log::warning("no sample belongs to an object");
    PALPATE_TRY(save_volume(out, labels, interrupt.token()));
    tell_made(out, labels);
    return {};
}

} // namespace palpate
