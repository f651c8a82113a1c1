// Options whose values are badly formed: wrong usage, found before any work.

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "tests/support/program.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

struct Misuse {
    const char* command;                // "render"
    std::vector<const char*> arguments; // beside those that the command needs
    const char* words;                  // of the one message
};

const Misuse kMisuses[] = {
    {"render", {"--mod", "mip"}, "found '--mod'; did you mean --mode?"},
    {"surface", {"--decimat=0.5"}, "found '--decimat=0.5'; did you mean --decimate?"},
    {"filter", {"gausian"}, "found 'gausian'; did you mean --gaussian?"},
    {"render", {"--slice", "diagonal"}, "--slice: expected axial, coronal or sagittal"},
    {"render", {"--slice", "axial:"}, "--slice: expected axial or axial:MM, found 'axial:'"},
    {"render", {"--slice", "axial:1,2"}, "--slice: expected axial or axial:MM"},
    {"render", {"--slice", "axially"}, "--slice: expected axial or axial:MM"},
    {"render", {"--slice", "coronal:nan"}, "--slice: expected coronal or coronal:MM"},
    {"render", {"--slice", "1,2,3,4,5"}, "--slice: expected 6 numbers"},
    {"render", {"--slice", "1,2,3,0,0,0"}, "--slice: expected a normal that is not 0"},
    {"render", {"--slice", "axial", "--slice", "1,2"}, "--slice: expected 6 numbers"},
    {"render", {"--clip", "1,2,3"}, "--clip: expected 6 numbers"},
    {"render", {"--clip", "1,2,3,4,5,six"}, "--clip: expected 6 numbers"},
    {"render", {"--clip", "1,2,3,4,5,6,"}, "--clip: expected 6 numbers"},
    {"render", {"--clip", "0,0,0,0,0,0"}, "--clip: expected a normal that is not 0"},
    {"render", {"--camera", "1,2,3"}, "--camera: expected 6 or 9 numbers, found 3"},
    {"render", {"--camera", "1,2,3,4,5,6,7"}, "--camera: expected 6 or 9 numbers, found 7"},
    {"render", {"--camera", "1,2,3,4,5,x"}, "--camera"},
    {"render",
     {"--camera", "1,2,3,1,2,3"},
     "--camera: expected a target that differs from the eye"},
    {"render", {"--window", "5,5"}, "--window: expected LOW below HIGH"},
    {"render", {"--window", "5"}, "--window"},
    {"render", {"--window-level", "40,0"}, "--window-level: expected a WIDTH above 0, found 0"},
    {"render", {"--iso", "1,2,3,4,5,6,7,8,9"}, "--iso: expected at most 8, found 9"},
    {"render", {"--iso", "high"}, "--iso"},
    {"render", {"--surface", "iso=high"}, "--surface: expected iso=VALUE, found 'iso=high'"},
    {"render", {"--surface-color", "1,2"}, "--surface-color: expected 3 numbers"},
    {"render", {"--surface-color", "0,0,2"}, "--surface-color: expected numbers from 0 to 1"},
    {"render", {"--surface-opacity", "2"}, "--surface-opacity"},
    {"render", {"--background", "1,1"}, "--background"},
    {"render", {"--size", "12"}, "--size"},
    {"render", {"--gpu-memory", "12Q"}, "--gpu-memory: expected bytes as 512M"},
    {"render", {"--mode", "fog"}, "--mode: expected one of"},
    {"render", {"--residency", "here"}, "--residency"},
    {"render", {"--frame", "-1"}, "--frame"},
    {"surface", {"--labels=0"}, "--labels: expected labels from 1 to 65535"},
    {"surface", {"--labels=1,,2"}, "--labels: expected labels from 1 to 65535"},
    {"surface", {"--iso", "5", "--smooth", "bounded"}, "--smooth bounded: expected --labels"},
    {"surface",
     {"--labels", "--walls", "separate", "--smooth", "bounded"},
     "--smooth bounded: expected --labels with shared walls, found --walls separate"},
    {"surface",
     {"--labels", "--walls", "separate", "--on", "gpu"},
     "--on gpu: expected shared walls"},
    {"surface", {"--iso", "5", "--decimate-to", "half"}, "--decimate-to: expected a share"},
    {"surface", {"--iso", "5", "--passes", "0"}, "--passes"},
    {"touch", {"--at", "1,2"}, "--at"},
    {"touch", {"--direction", "0,0,0"}, "--direction: expected a direction, found a length of 0"},
    {"touch", {"--friction", "0.1,0.3"}, "of at most the static 0.1, found 0.3"},
    {"touch", {"--friction", "1,2,3"}, "--friction"},
    {"touch", {"--label-feel", "1"}, "--label-feel: expected LABEL,STIFFNESS[,FRICTION[,T0]]"},
    {"touch", {"--label-feel", "1.5,2"}, "--label-feel: expected LABEL,STIFFNESS"},
    {"touch", {"--transfer", "1:2,1:3"}, "--transfer: expected values that rise"},
    {"touch", {"--transfer", "1,2"}, "--transfer: expected A or A,CENTER,WIDTH"},
    {"touch", {"--transfer-across", "a:b"}, "--transfer-across: expected a VALUE:NUMBER pair"},
    {"touch", {"--opacity", "5"}, "--opacity: expected a VALUE:NUMBER pair, found '5'"},
    {"touch", {"--edit", "{\"kind\": \"hop\"}"}, "--edit: JSON:1: kind: expected"},
    {"touch", {"--edit", "{"}, "--edit: JSON:1: "},
    {"touch", {"--edit", "{\"kind\": \"fill\"}"}, "--edit: 'fill' takes effect after the stroke"},
    {"touch", {"--edit", "{\"kind\": \"cut\"}"}, "--edit: needs a --tool"},
    {"touch",
     {"--drill", "2", "--algorithm", "swept-mesh", "--mesh", "m.ply"},
     "swept-mesh feels the mesh of --mesh"},
    {"touch", {"--second-edit", R"({"kind": "cut"})"}, "--second-edit: needs an --edit"},
    {"touch",
     {"--label-feel", "1,500", "--algorithm", "vidholm-2004"},
     "vidholm-2004 feels all labels alike"},
    {"touch", {"--felt-tool", "{\"kind\": \"spoon\"}"}, "--felt-tool: JSON:1: kind: expected"},
    {"touch", {"--tool", "{\"kind\": \"ball\"}"}, "--tool: JSON:1: "},
    {"touch", {"--field", "a,b"}, "--field"},
    {"compare", {"--bound", "-1"}, "--bound: expected a number of 0 or above"},
    {"compare", {"--geometry", "near"}, "--geometry: expected a number of 0 or above"},
    {"convert", {"--max-memory", "0"}, "--max-memory: expected a number above 0"},
    {"info", {"--frame", "two"}, "--frame"},
    {"edit", {"--history-memory", "lots"}, "--history-memory: expected a number of 0 or above"},
    {"edit", {"--undo", "-1"}, "--undo"},
    {"bench", {}, "SUITE: expected one of page, "},
};

class Usage : public ProgramTest {
 protected:
    std::vector<std::string> needed(const std::string& command) const {
        const std::string volume = "synthetic:ball?size=8", out = file("out").string();
        const std::map<std::string, std::vector<std::string>> words{
            {"render", {volume, "-o", out + ".png"}},
            {"surface", {volume, "-o", out + ".ply"}},
            {"touch", {volume, "--trajectory", "press", "--report", out + ".csv"}},
            {"compare", {volume, volume}},
            {"convert", {volume, out + ".nrrd"}},
            {"info", {volume}},
            {"filter", {volume, "-o", out + ".nrrd"}},
            {"edit", {volume, out + ".jsonl", "-o", out + ".nrrd"}},
            {"bench", {"speed", "-o", out}}};
        return words.at(command);
    }
};

TEST_F(Usage, BadlyFormedValuesExitWith2AndNameTheOption) {
    for (const Misuse& misuse : kMisuses) {
        std::vector<std::string> words = needed(misuse.command);
        words.insert(words.begin(), misuse.command);
        words.insert(words.end(), misuse.arguments.begin(), misuse.arguments.end());
        const ProgramRun ran = run(words);
        EXPECT_EQ(ran.exit_code, 2) << misuse.words << ran.messages;
        EXPECT_EQ(ran.output, "") << misuse.words;
        EXPECT_THAT(ran.messages, HasSubstr(misuse.words));
        EXPECT_LE(std::count(ran.messages.begin(), ran.messages.end(), '\n'), 2) << ran.messages;
    }
    for (const auto& entry : std::filesystem::directory_iterator(file(""))) // nothing was begun
        EXPECT_THAT(entry.path().filename(), ::testing::AnyOf("stdout", "stderr"));
}

} // namespace
} // namespace palpate
