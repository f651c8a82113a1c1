// golden_test check FOLDER WORK   compares a golden case with what the program draws now; where
//                                 PALPATE_DEVICE names another device than llvmpipe, with truth
//                                 alone
// golden_test bless FOLDER WORK   makes what the program draws now the case's expected picture
// golden_test measure FOLDER WORK PROGRAM DEVICE
//                                 draws with another program or device and prints the numbers of a
//                                 check as JSON, whatever they are
//
// FOLDER is golden/<case>, described in golden/README.md; WORK is a folder for what is drawn.
// Exit 0 when passed or blessed, else 1 with a sentence.
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string_view>

#include "engine/base/file.h"
#include "engine/decode/serve.h"
#include "engine/image/compare.h"
#include "engine/image/exr.h"
#include "engine/image/png.h"
#include "engine/io/scene_data.h"
#include "engine/loading/scene_meshes.h"
#include "engine/reference/truth.h"
#include "engine/render/display_layout.h"
#include "tests/support/paths.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct GoldenCase {
    std::string name;
    fs::path folder, work;
    Json scene;                          // as in a scene file, size_px included
    double max_channel_difference = 0.0; // in 1/255 of white
    double max_differing_share = 0.0;    // of pixels that may differ by more, 0 .. 1
    double stated_error = 0.0;           // RMSE of colours against grid truth, 1 is white
    uint32_t truth_step = 1;             // truth is taken at every n-th pixel, both ways

    fs::path expected() const { return folder / "expected.exr"; }
};

Result<Json> load_json(const fs::path& path) {
    PALPATE_TRY(const std::string text, load_text(path));
    try {
        return Json::parse(text);
    } catch (const Json::exception& error) {
        return fail("{}: {}", path.string(), error.what());
    }
}

Result<GoldenCase> load_case(const fs::path& folder, const fs::path& work) {
    const fs::path path = folder / "case.json";
    PALPATE_TRY(const Json json, load_json(path));
    GoldenCase golden{.name = folder.filename(), .folder = folder, .work = work};
    try {
        golden.scene = json.at("scene");
        golden.scene["size_px"] = json.at("size_px");
        golden.max_channel_difference = json.at("max_channel_difference");
        golden.max_differing_share = json.at("max_differing_share");
        golden.stated_error = json.at("stated_error");
        golden.truth_step = json.value("truth_step", 1u);
        if (json.at("why").get<std::string>().empty())
            return fail("{}: expected a reason under 'why', found none", path.string());
    } catch (const Json::exception& error) {
        return fail("{}: {}", path.string(), error.what());
    }
    // Pixels of a joint or mirrored picture do not lie where those of an eye do.
    const bool moved = golden.scene.contains("stereo") || golden.scene.contains("mirror");
    if (golden.truth_step < 1 || (golden.truth_step > 1 && moved))
        return fail(
            "{}: expected truth_step 1 in stereo or a mirror, and at least 1 else, found {}",
            path.string(), golden.truth_step);
    return golden;
}

// Every n-th pixel of a picture, colours and alpha alone.
Image every_nth(const Image& image, uint32_t step) {
    Image out = make_image((image.size_px + step - 1u) / step, {"R", "G", "B", "A"});
    for (uint32_t y = 0; y < out.size_px.y; ++y)
        for (uint32_t x = 0; x < out.size_px.x; ++x)
            for (size_t c = 0; c < 4; ++c)
                out.at(x, y, c) =
                    image.at(x * step, y * step, *channel_index(image, out.channels[c]));
    return out;
}

// The colours and alpha of a picture; scenes may have other channels.
Result<ExrFile> load_colors(const fs::path& path) {
    PALPATE_TRY(ExrFile file, load_exr(path));
    for (const char* name : {"R", "G", "B", "A"})
        if (!channel_index(file.image, name))
            return fail("{}: expected the channels R, G, B and A, found no {}", path.string(),
                        name);
    file.image = every_nth(file.image, 1);
    return file;
}

const std::string kGoldenDevice = "llvmpipe"; // that golden pictures are made on

// Who draws: the program beside this one, on the kind of driver that golden pictures are made for;
// or as told.
struct Drawer {
    std::string program = kProgram, device = kGoldenDevice, more = " --validate";
};

// The scene; of a case with strokes, that of the volume they leave.
Result<Json> edited_scene(const GoldenCase& golden, const Drawer& drawer) {
    const fs::path strokes = golden.folder / "strokes.jsonl", edited = golden.work / "edited.nrrd";
    Json scene = golden.scene;
    if (!fs::exists(strokes))
        return scene;
    const std::string command =
        fmt::format("'{}' --quiet edit '{}' '{}' --discard -o '{}'", drawer.program,
                    scene["volume"].get<std::string>(), strokes.string(), edited.string());
    if (const int status = std::system(command.c_str()); status != 0)
        return fail("{}: palpate edit ended with status {}", golden.name, status);
    scene["volume"] = edited.string();
    return scene;
}

Result<ExrFile> draw(const GoldenCase& golden, const Drawer& drawer = {}) {
    const fs::path scene = golden.work / "scene.json", actual = golden.work / "actual.exr";
    PALPATE_TRY(const Json edited, edited_scene(golden, drawer));
    const std::string text = edited.dump(2);
    PALPATE_TRY(save_bytes(scene, std::as_bytes(std::span(text))));
    fs::remove(actual);
    // Mesa's software driver compiles for the widest vectors it finds; one width gives one picture.
    setenv("LP_NATIVE_VECTOR_WIDTH", "256", 1);
    const std::string command =
        fmt::format("'{}' --quiet render '{}' -o '{}' --half --device '{}'{}", drawer.program,
                    scene.string(), actual.string(), drawer.device, drawer.more);
    if (const int status = std::system(command.c_str()); status != 0)
        return fail("{}: palpate render ended with status {}", golden.name, status);
    return load_colors(actual);
}

// The field itself, as a picture like the program's but for truth_step.
Result<Image> truth_of(const GoldenCase& golden) {
    PALPATE_TRY(const SceneFile file, load_scene(golden.work / "scene.json"));
    PALPATE_TRY(LoadedScene loaded, load_scene_data(file));
    PALPATE_TRY(make_scene_meshes(file, loaded));
    const Scene scene = resolved_scene(file, loaded.data.volume.grid());
    std::vector<Image> eyes;
    for (int eye = 0; eye < (scene.stereo ? 2 : 1); ++eye)
        eyes.push_back(render_truth(scene, loaded.data, eye, {.step = golden.truth_step}));
    return every_nth(display_image(eyes, display_layout(scene)), 1);
}

// The picture's RMSE against truth; an error when it is more than stated.
Result<double> check_truth(const GoldenCase& golden, const char* which, const Image& picture,
                           const Image& truth) {
    Result<ImageDifference> difference =
        compare_images(truth, every_nth(picture, golden.truth_step), 0.0);
    if (!difference)
        return fail("{}: {} and truth: {}", golden.name, which, difference.error().message);
    const double rmse = difference->all.rmse;
    if (!(rmse <= golden.stated_error) || difference->all.nan_mismatch > 0)
        return fail("{}: {} is {:.6f} from grid truth (RMSE), more than the stated {:.6f}",
                    golden.name, which, rmse, golden.stated_error);
    return rmse;
}

std::string drawn_on(const ExrFile& file) {
    auto text = [&](const char* key) {
        const auto at = file.metadata.find(key);
        return at == file.metadata.end() ? std::string("unknown") : at->second;
    };
    return text("palpate:device") + ", " + text("palpate:driver");
}

// Leaves the pictures and the two numbers where a person finds them.
Result<void> leave_evidence(const GoldenCase& golden, const Image& expected, const Image& actual,
                            const SampleDifference& difference) {
    const float gain = 8.0f; // small differences would be too dark to see
    const std::string numbers = Json{{"channel_difference", difference.max_abs * 255.0},
                                     {"max_channel_difference", golden.max_channel_difference},
                                     {"differing_share", difference.share_beyond},
                                     {"max_differing_share", golden.max_differing_share}}
                                    .dump(2);
    fs::copy_file(golden.expected(), golden.work / "expected.exr",
                  fs::copy_options::overwrite_existing);
    PALPATE_TRY(save_png(golden.work / "difference.png", difference_image(expected, actual, gain)));
    return save_bytes(golden.work / "numbers.json", std::as_bytes(std::span(numbers)));
}

Result<void> check(const GoldenCase& golden) {
    PALPATE_TRY(ExrFile expected, load_colors(golden.expected()));
    PALPATE_TRY(ExrFile actual, draw(golden));
    Result<ImageDifference> difference =
        compare_images(expected.image, actual.image, golden.max_channel_difference / 255.0);
    if (!difference)
        return fail("{}: {}", golden.name, difference.error().message);
    const SampleDifference& all = difference->all;
    if (all.share_beyond > golden.max_differing_share) {
        PALPATE_TRY(leave_evidence(golden, expected.image, actual.image, all));
        return fail(
            "{}: {:.4f} of the pixels differ by more than {:g}/255, allowed are {:.4f}; the "
            "largest difference is {:.1f}/255; drawn on {}, expected from {}; see {}",
            golden.name, all.share_beyond, golden.max_channel_difference,
            golden.max_differing_share, all.max_abs * 255.0, drawn_on(actual), drawn_on(expected),
            golden.work.string());
    }
    PALPATE_TRY(const Image truth, truth_of(golden));
    for (const auto& [which, file] :
         {std::pair("expected.exr", &expected), std::pair("the picture drawn now", &actual)}) {
        PALPATE_TRY(const double error, check_truth(golden, which, file->image, truth));
        fmt::print("{}: {}: {:.6f} from truth, stated {:g}\n", golden.name, which, error,
                   golden.stated_error);
    }
    fmt::print("{}: {:.4f} of the pixels differ by more than {:g}/255, the most by {:.2f}/255\n",
               golden.name, all.share_beyond, golden.max_channel_difference, all.max_abs * 255.0);
    return {};
}

// On another driver: filters interpolate with other digits there, so the picture is held against
// grid truth alone, within the error that the case states.
Result<void> check_elsewhere(const GoldenCase& golden, const std::string& device) {
    PALPATE_TRY(const ExrFile actual, draw(golden, {.device = device}));
    PALPATE_TRY(const Image truth, truth_of(golden));
    PALPATE_TRY(const double error, check_truth(golden, "the picture", actual.image, truth));
    fmt::print("{}: on {}: {:.6f} from truth, stated {:g}\n", golden.name, drawn_on(actual), error,
               golden.stated_error);
    return {};
}

Result<void> measure(const GoldenCase& golden, const Drawer& drawer) {
    PALPATE_TRY(const ExrFile expected, load_colors(golden.expected()));
    PALPATE_TRY(const ExrFile actual, draw(golden, drawer));
    PALPATE_TRY(const Image truth, truth_of(golden));
    Result<ImageDifference> error =
        compare_images(truth, every_nth(actual.image, golden.truth_step), 0.0);
    Result<ImageDifference> difference =
        compare_images(expected.image, actual.image, golden.max_channel_difference / 255.0);
    for (const auto* compared : {&error, &difference})
        if (!*compared)
            return fail("{}: {}", golden.name, compared->error().message);
    const Json numbers{{"rmse", error->all.rmse},
                       {"stated_error", golden.stated_error},
                       {"differing_share", difference->all.share_beyond},
                       {"max_differing_share", golden.max_differing_share},
                       {"channel_difference", difference->all.max_abs * 255.0},
                       {"drawn_on", drawn_on(actual)}};
    fmt::print("{}\n", numbers.dump());
    return {};
}

Result<void> bless(const GoldenCase& golden) {
    PALPATE_TRY(const Json driver, load_json(golden.folder.parent_path() / "driver.json"));
    PALPATE_TRY(const ExrFile actual, draw(golden));
    const std::string recorded = driver.value("device", "") + ", " + driver.value("driver", "");
    if (drawn_on(actual) != recorded)
        return fail("{}: golden pictures are blessed on {} only, and this is {}", golden.name,
                    recorded, drawn_on(actual));
    PALPATE_TRY(const Image truth, truth_of(golden));
    PALPATE_TRY(const double error, check_truth(golden, "the picture", actual.image, truth));
    if (Result<ExrFile> before = load_colors(golden.expected())) {
        Result<ImageDifference> change = compare_images(before->image, actual.image, 0.0);
        if (change)
            fmt::print("{}: {:.4f} of the pixels change, the most by {:.2f}/255\n", golden.name,
                       change->all.share_beyond, change->all.max_abs * 255.0);
    }
    fmt::print("{}: blessed, {:.6f} from truth, stated {:g}\n", golden.name, error,
               golden.stated_error);
    PALPATE_TRY(const std::string bytes, load_text(golden.work / "actual.exr"));
    return save_bytes(golden.expected(), std::as_bytes(std::span(bytes)));
}

int run(int argc, char** argv) {
    const std::string_view mode = argc > 1 ? argv[1] : "";
    if (!(argc == 4 && (mode == "check" || mode == "bless")) && !(argc == 6 && mode == "measure")) {
        fmt::print(stderr,
                   "usage: golden_test check|bless FOLDER WORK\n"
                   "       golden_test measure FOLDER WORK PROGRAM DEVICE\n");
        return 2;
    }
    fs::create_directories(argv[3]);
    for (const char* name : {"expected.exr", "difference.png", "numbers.json"})
        fs::remove(fs::path(argv[3]) / name);
    const Result<GoldenCase> golden = load_case(fs::absolute(argv[2]), fs::absolute(argv[3]));
    const char* wish = std::getenv("PALPATE_DEVICE");
    const std::string device = wish && *wish ? wish : kGoldenDevice;
    const bool elsewhere = mode == "check" && device != kGoldenDevice;
    const Result<void> done = !golden             ? Result<void>(fail("{}", golden.error().message))
                              : elsewhere         ? check_elsewhere(*golden, device)
                              : mode == "measure" ? measure(*golden, {argv[4], argv[5], ""})
                              : mode == "check"   ? check(*golden)
                                                  : bless(*golden);
    if (!done)
        fmt::print(stderr, "golden: {}\n", done.error().message);
    return done ? 0 : 1;
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) {
    if (argc > 1 && std::string_view(argv[1]) == "__decode") // a child of load_volume()
        palpate::io::serve_decoding(argc, argv);
    try {
        return palpate::run(argc, argv);
    } catch (const std::exception& error) {
        fmt::print(stderr, "golden: {}\n", error.what());
        return 1;
    }
}
