// palpate batch: many pictures on one device, a line of JSON each.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "apps/palpate/command.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/base/timer.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/picture_options.h"
#include "engine/program/render_warnings.h"

namespace palpate {

namespace {

constexpr uint64_t kMostBytes = uint64_t{256} << 20; // of a file of jobs

struct BatchOptions {
    std::string jobs, device, gradients = "taps";
    bool keep_going = false, validate = false;
};

// One line: a picture with options of its own.
struct Job {
    std::string place; // "jobs.jsonl:3"
    CLI::App app;
    PictureOptions options;
    std::string output;
};

// A value as the command line has it: a number with all its digits, a text, an object as JSON.
std::string text_of(const Json& value) {
    if (value.kind == Json::Kind::string)
        return value.string;
    std::string text = json_text(value);
    while (!text.empty() && text.back() == '\n')
        text.pop_back();
    return text;
}

// {"mode": "iso", "iso": [-300, 300], "slice": ["axial", "coronal"], "values": true} as
// --mode=iso --iso=-300,300 --slice=axial --slice=coronal --values.
Result<std::vector<std::string>> words_of(const Json& job) {
    std::vector<std::string> words;
    for (const auto& [key, value] : job.members) {
        if (key == "input" || key == "output")
            continue;
        const std::string flag = "--" + key;
        if (value.kind == Json::Kind::boolean) {
            if (value.boolean)
                words.push_back(flag);
        } else if (value.kind == Json::Kind::array) {
            const bool numbers =
                std::all_of(value.items.begin(), value.items.end(),
                            [](const Json& v) { return v.kind == Json::Kind::number; });
            std::string joined;
            for (const Json& item : value.items) {
                if (item.kind == Json::Kind::array || item.kind == Json::Kind::null)
                    return fail("{}: expected a list of numbers or of texts", key);
                if (numbers)
                    joined += (joined.empty() ? "" : ",") + text_of(item);
                else
                    words.push_back(flag + "=" + text_of(item));
            }
            if (numbers && !joined.empty())
                words.push_back(flag + "=" + joined);
        } else if (value.kind != Json::Kind::null) {
            words.push_back(flag + "=" + text_of(value));
        }
    }
    words.insert(words.end(), {"--", text_of(job["input"])});
    return words;
}

Result<std::unique_ptr<Job>> read_job(std::string_view line, const std::string& file, int number) {
    PALPATE_TRY(const Json json, parse_json(line, file, number));
    auto job = std::make_unique<Job>();
    job->place = fmt::format("{}:{}", file, number);
    for (const char* key : {"input", "output"})
        if (json.kind != Json::Kind::object || !json.contains(key) ||
            json[key].kind != Json::Kind::string)
            return fail(
                "{}: expected an object with the texts \"input\" and \"output\", and options of "
                "palpate render by name",
                job->place);
    job->output = json["output"].string;
    if (!job->output.ends_with(".png") && !job->output.ends_with(".exr"))
        return fail("{}: output: expected a name ending in .png or .exr, found {}", job->place,
                    job->output);
    add_picture_options(job->app, job->options);
    for (const char* option : {"device", "validate", "residency", "gpu-memory", "sampling",
                               "gradients", "volume-format", "no-skipping"})
        if (json.contains(option))
            return fail(
                "{}: {}: one device draws all jobs; give --device, --gradients and --validate to "
                "palpate batch",
                job->place, option);
    refuse_not_finite(job->app);
    job->app.set_help_flag();
    Result<std::vector<std::string>> words = words_of(json);
    if (!words)
        return fail("{}: {}", job->place, words.error().message);
    std::reverse(words->begin(), words->end());
    try {
        job->app.parse(*words);
    } catch (const CLI::ParseError& error) {
        return fail("{}: {}", job->place, error.what());
    }
    return job;
}

Result<std::vector<std::unique_ptr<Job>>> read_jobs(const std::string& file) {
    PALPATE_TRY(const std::string text, load_text(file, kMostBytes));
    std::vector<std::unique_ptr<Job>> jobs;
    int number = 0;
    for (size_t begin = 0; begin < text.size();) {
        const size_t end = std::min(text.find('\n', begin), text.size());
        const std::string_view line = std::string_view(text).substr(begin, end - begin);
        begin = end + 1;
        ++number;
        if (line.find_first_not_of(" \t\r") == std::string_view::npos)
            continue;
        PALPATE_TRY(std::unique_ptr<Job> job, read_job(line, file, number));
        jobs.push_back(std::move(job));
    }
    if (jobs.empty())
        return fail("{}: expected a job a line, found none", file);
    return jobs;
}

// Draws jobs on one device. The volume of the job before stays in memory and on the device.
class Drawer {
 public:
    Drawer(const BatchOptions& options, const Interrupt& interrupt)
        : interrupt_(interrupt),
          device_({.select = options.device, .validation = options.validate}),
          renderer_(device_, renderer_options(of_device(options), device_, false)) {}

    Result<void> draw(Job& job) {
        const PictureOptions& o = job.options;
        PALPATE_TRY(OpenedScene opened, open(o));
        make_room_for_legend(o.figure, o.scene, opened);
        const SceneToDraw to_draw{o.scene, opened.file, opened.scene, opened.loaded};
        warn_of_idle_options(job.app, to_draw, job.output, 1);
        if (const std::string idle = idle_mark(o.figure, opened); !idle.empty())
            log::warning("{}: {}", job.place, idle);
        for (const std::string& sentence : empty_parts(to_draw))
            log::warning("{}: {}", job.place, sentence);
        if (o.frames.frame_ms > 0)
            return fail("frame-ms: expected without a budget of time");
        PALPATE_TRY(meet_error(o, device_, renderer_options(o, device_, false), opened.loaded.data,
                               opened.scene));
        PALPATE_TRY(renderer_.draw(opened.scene, opened.loaded.data));
        PALPATE_TRY(save_frame(job.output, look_of(o, opened), opened.scene, renderer_.read_back(),
                               metadata_of(device_, drawn_file(opened.file, opened.scene))));
        if (!device_.validation_messages().empty())
            return fail("Vulkan validation: {}", device_.validation_messages().front());
        return {};
    }

 private:
    static PictureOptions of_device(const BatchOptions& options) {
        PictureOptions picture;
        picture.memory.gradients = options.gradients;
        return picture;
    }

    // A volume named as in the job before is taken from memory, where nothing else is to be read.
    Result<OpenedScene> open(const PictureOptions& o) {
        const std::string key = fmt::format("{} {} {} {}", o.scene.input, o.read.frame,
                                            o.read.series, o.read.resample_slices);
        const bool plain = !has_scene(o.scene.input) && o.scene.labels.empty() &&
                           o.scene.fused.empty() && o.scene.overlay.empty();
        InMemory memory;
        if (plain && key == key_)
            memory.volumes.emplace(o.scene.input, *kept_);
        PALPATE_TRY(OpenedScene opened, open_scene(o.scene, o.read, interrupt_.token(), memory));
        if (plain && key != key_) {
            const LoadedScene& loaded = opened.loaded;
            key_ = key;
            kept_ = LoadedVolume{
                loaded.data.volume, {}, {}, loaded.modality, loaded.coarser, loaded.label_names,
                loaded.inverted};
        }
        return opened;
    }

    const Interrupt& interrupt_;
    GpuDevice device_;
    Renderer renderer_;
    std::string key_;
    std::optional<LoadedVolume> kept_;
};

Result<void> run_batch(const BatchOptions& options) {
    PALPATE_TRY(const auto jobs, read_jobs(options.jobs));
    const Interrupt interrupt;
    Drawer drawer(options, interrupt);
    size_t failed = 0;
    for (const std::unique_ptr<Job>& job : jobs) {
        const Timer timer;
        FilesTogether pictures; // of both eyes
        Result<void> drawn = drawer.draw(*job);
        if (interrupt.token().stop_requested())
            return fail("{}: interrupted; the pictures of the jobs before are written, each whole",
                        job->place);
        if (drawn)
            drawn = pictures.commit();
        if (!drawn && !options.keep_going)
            return fail("{}: {}; the pictures of the jobs before are written", job->place,
                        drawn.error().message);
        if (drawn) {
            log::info("{}: {:.0f} ms", job->output, timer.ms());
            continue;
        }
        log::error("{}: {}", job->place, drawn.error().message);
        ++failed;
    }
    if (failed > 0)
        return fail("{}: {} of {} jobs failed", options.jobs, failed, jobs.size());
    return {};
}

std::vector<NamedFile> files_of(const BatchOptions& options) {
    std::vector<NamedFile> files{{"JOBS", options.jobs}};
    if (const auto jobs = read_jobs(options.jobs)) // else it is told later
        for (const std::unique_ptr<Job>& job : *jobs) {
            append_volume(files, "input of " + job->place, job->options.scene.input);
            files.push_back({"output of " + job->place, job->output, FileUse::write});
        }
    return files;
}

} // namespace

Command add_batch(CLI::App& app) {
    auto o = std::make_shared<BatchOptions>();
    app.add_option(
           "JOBS", o->jobs,
           "A job a line, JSON: {\"input\": \"head.nii.gz\", \"output\": \"head.png\", \"iso\": "
           "300}, with the options of palpate render by name; true for flags, lists for "
           "several values. Names of files are relative to the working folder")
        ->required();
    app.add_flag("--keep-going", o->keep_going,
                 "Go on after a job that fails (default: stop there); exit status 1 at the end");
    app.add_option("--device", o->device, "Vulkan device, as of palpate render");
    app.add_option("--gradients", o->gradients,
                   "Gradients of shaded alpha: taps, as palpate render takes them for one picture, "
                   "to the bit; or stored, faster for many pictures of one volume on devices "
                   "without a hardware sampler, with colours that differ by up to 1e-3")
        ->check(one_of({"taps", "stored"}))
        ->capture_default_str();
    app.add_flag("--validate", o->validate,
                 "Run under Vulkan validation; a validation message is a failure");
    return {[o] { return run_batch(*o); }, [o] { return files_of(*o); }};
}

} // namespace palpate
