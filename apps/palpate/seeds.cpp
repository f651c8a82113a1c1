#include <algorithm>
#include <memory>

#include "apps/palpate/command.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/progress.h"
#include "engine/program/read_options.h"
#include "engine/segment/simulated_seeds.h"

namespace palpate {

namespace {

struct SeedsOptions {
    ReadFlags read;
    std::vector<uint32_t> labels{1};
    SimulatedSeedOptions how;
    uint32_t background = 0;
    std::string out;
};

Result<void> run_seeds(const SeedsOptions& o) {
    const Interrupt interrupt;
    PALPATE_TRY(const LoadedVolume loaded, load(o.read, true, interrupt));
    SeedFile all{{}, static_cast<uint16_t>(o.background), loaded.volume.grid()};
    Progress progress("placing seeds");
    for (size_t n = 0; n < o.labels.size(); ++n) {
        SimulatedSeedOptions how = o.how;
        how.label = static_cast<uint16_t>(o.labels[n]);
        const Task whole{interrupt.token(), [&](double share) { progress.show(share); }};
        const Result<SeedFile> made =
            simulated_seeds(loaded.volume, how,
                            whole.part(double(n) / double(o.labels.size()),
                                       double(n + 1) / double(o.labels.size())));
        if (!made)
            return fail("{}: {}", o.read.path, made.error().message);
        all.balls.insert(all.balls.end(), made->balls.begin(), made->balls.end());
    }
    return write_text(o.out, seeds_text(all));
}

} // namespace

Command add_seeds(CLI::App& app) {
    auto o = std::make_shared<SeedsOptions>();
    add_read_flags(app, o->read);
    app.add_option("--label", o->labels,
                   "Label of an object that gets seeds; may be repeated (default: 1)")
        ->check(CLI::Range(1u, 65535u))
        ->take_all()
        ->expected(1)
        ->allow_extra_args(false);
    app.add_option("--background", o->background,
                   "Which of these labels stands for outside all objects (default: none)")
        ->check(CLI::Range(1u, 65535u));
    app.add_option("--count", o->how.count, "Balls for each label (default: 3)")
        ->check(CLI::Range(1u, 10000u));
    app.add_option("--radius", o->how.radius_mm, "Mean radius of balls, mm (default: 8)")
        ->check(positive());
    app.add_option("--jitter", o->how.jitter_mm,
                   "Standard deviation of the centres along each axis, mm (default: 3)")
        ->check(non_negative());
    app.add_option("--mistakes", o->how.mistakes,
                   "Chance that a centre that falls outside its object stays, 0 .. 1 (default: "
                   "0.05)")
        ->check(within(0.0, 1.0));
    app.add_option("--random", o->how.random, "Number that chooses the seeds (default: 1)");
    app.add_option("-o,--output", o->out, "Seed file to write (.json), or - (default: -)")
        ->type_name("FILE");
    refuse_where_wrong(app, [o]() -> Result<void> {
        if (o->background != 0 && std::ranges::find(o->labels, o->background) == o->labels.end())
            return fail("--background: expected one of the labels of --label, found {}",
                        o->background);
        return {};
    });
    return {[o] {
                if (o->out.empty())
                    o->out = "-";
                return run_seeds(*o);
            },
            [o] {
                std::vector<NamedFile> files;
                append_volume(files, "V", o->read.path);
                files.push_back({"-o", o->out, FileUse::write_text});
                return files;
            }};
}

} // namespace palpate
