#include "engine/program/turntable.h"

#include <unistd.h>

#include <filesystem>

#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/image/movie.h"
#include "engine/program/option_checks.h"
#include "engine/program/project_input.h"
#include "engine/program/scene_options.h"
#include "engine/scene/camera_path.h"
#include "engine/scene/scene_file.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

bool is_movie(const std::string& output) {
    return output.ends_with(".mp4");
}

// The place of a picture's number in a file's name, and how many digits it has: the last run of #,
// or %03d as other programs write it.
struct NumberPlace {
    size_t begin = 0, length = 0, digits = 0;
};

NumberPlace number_place(const std::string& output) {
    const size_t folder = output.find_last_of('/');
    const size_t start = folder == output.npos ? 0 : folder + 1;
    if (const size_t percent = output.find_last_of('%');
        percent != output.npos && percent >= start && percent + 3 < output.size() &&
        output[percent + 1] == '0' && output[percent + 2] >= '1' && output[percent + 2] <= '9' &&
        output[percent + 3] == 'd')
        return {percent, 4, static_cast<size_t>(output[percent + 2] - '0')};
    const size_t end = output.find_last_of('#');
    if (end == output.npos || end < start)
        return {};
    const size_t before = output.find_last_not_of('#', end);
    const size_t begin = before == output.npos ? 0 : before + 1;
    return {begin, end + 1 - begin, end + 1 - begin};
}

std::string numbered(std::string name, size_t number) {
    const NumberPlace place = number_place(name);
    return name.replace(place.begin, place.length, fmt::format("{:0{}}", number, place.digits));
}

// The cameras of the way: the scene's own, then those of the path; cameras that a volume decides by
// the one that is drawn.
Result<std::vector<Camera>> cameras_of(const TurntableOptions& options, const Camera& first,
                                       const Grid& grid) {
    std::vector<Camera> cameras{first};
    for (const std::string& name : options.path) {
        if (!has_scene(name))
            return fail("--camera-path: expected a scene file (.json) or a project, found '{}'",
                        name);
        const Result<SceneFile> scene = scene_file_of(name);
        if (!scene)
            return fail("--camera-path: {}", scene.error().message);
        cameras.push_back(resolved_scene(*scene, grid).camera);
    }
    return cameras;
}

Camera camera_of(const TurntableOptions& options, const std::vector<Camera>& cameras,
                 uint32_t frame) {
    if (cameras.size() == 1)
        return orbit(cameras.front(), 360.0 * frame / options.frames);
    return along(cameras, options.frames > 1 ? double(frame) / (options.frames - 1) : 0.0);
}

// A folder that is gone when this is.
struct TemporaryFolder {
    fs::path path;
    ~TemporaryFolder() {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
};

} // namespace

void add_turntable_options(CLI::App& app, TurntableOptions& o) {
    CLI::Option* frames =
        app.add_option(
               "--turntable", o.frames,
               "Write N pictures of a camera that goes round once about its up axis, to "
               "a name with #### or %04d for the number, or to an .mp4 by ffmpeg (default: one "
               "picture)")
            ->check(CLI::Range(1, 10000))
            ->type_name("N");
    app.add_option("--camera-path", o.path,
                   "With --turntable: instead of once round, from the scene's camera through "
                   "those of these scenes, separated by commas")
        ->delimiter(',')
        ->needs(frames)
        ->type_name("SCENE");
    app.add_option("--fps", o.frames_per_s, "With an .mp4: pictures a second")
        ->check(within(0.1, 1000.0))
        ->capture_default_str();
    for (const char* other :
         {"--frames", "--orbit-deg", "--frame-ms", "--settle", "--preview", "--stats"})
        frames->excludes(app.get_option(other));
}

Result<void> check_together(const TurntableOptions& o, const std::string& output) {
    if (o.frames == 0) {
        if (is_movie(output))
            return fail("{}: a movie needs --turntable, its number of pictures", output);
        if (number_place(output).length > 1)
            return fail(
                "{}: numbered pictures need --turntable, how many; --frames times frames and "
                "writes the last",
                output);
        return {};
    }
    if (!is_movie(output) && number_place(output).digits == 0)
        return fail(
            "{}: --turntable needs a name with #### or %04d in it, which becomes the number of the "
            "picture, or one ending in .mp4",
            output);
    const size_t digits = number_place(output).digits;
    if (const std::string last = std::to_string(o.frames - 1);
        !is_movie(output) && last.size() > digits)
        return fail("{}: expected {} digits for {} pictures, found {}", output, last.size(),
                    o.frames, digits);
    return {};
}

std::vector<std::string> frame_names(const TurntableOptions& o, const std::string& output) {
    std::vector<std::string> names;
    if (number_place(output).digits > 0)
        for (uint32_t i = 0; i < o.frames; ++i)
            names.push_back(numbered(output, i));
    return names;
}

Result<void> draw_turntable(
    const TurntableOptions& o, const Camera& first, const Grid& grid, const std::string& output,
    const std::function<Result<void>(const Camera&, const std::string& file)>& draw,
    const std::stop_token& stop) {
    PALPATE_TRY(const std::vector<Camera> cameras, cameras_of(o, first, grid));
    TemporaryFolder folder; // of a movie's frames, beside it
    std::optional<FilesTogether> movie_frames;
    if (is_movie(output)) {
        movie_frames.emplace();
        if (Result<void> there = expect_movie_encoder(); !there)
            return fail("{}: {}; --turntable also writes single pictures, to a name with ####",
                        output, there.error().message);
        const fs::path path = fs::absolute(output);
        folder.path =
            path.parent_path() / fmt::format(".{}.frames.{}", ::getpid(), path.filename().string());
        std::error_code error;
        if (!fs::create_directory(folder.path, error))
            return fail("{}: cannot be written: {}", output, error.message());
    }
    for (uint32_t i = 0; i < o.frames; ++i) {
        const std::string file =
            is_movie(output) ? (folder.path / movie_frame_name(i)).string() : numbered(output, i);
        Result<void> drawn = stop.stop_requested() ? Result<void>(fail("interrupted"))
                                                   : draw(camera_of(o, cameras, i), file);
        if (!drawn && is_movie(output))
            return fail("{}: {}, in picture {} of {}; nothing is written", output,
                        drawn.error().message, i + 1, o.frames);
        if (!drawn && stop.stop_requested()) {
            PALPATE_TRY(FilesTogether::commit_newest());
            return fail("{}; {} of {} pictures are written, each whole", drawn.error().message, i,
                        o.frames);
        }
        if (!drawn)
            return fail("{}, in picture {} of {}; nothing is written", drawn.error().message, i + 1,
                        o.frames);
    }
    if (!is_movie(output))
        return {};
    PALPATE_TRY(movie_frames->commit());
    movie_frames.reset();
    return make_movie(folder.path, o.frames_per_s, output, stop);
}

} // namespace palpate
