// Names and headers of files may hold escape sequences: none reaches the terminal.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/support/program.h"
#include "tests/unit/io_formats/sample_files.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kEscape = "\x1b]0;owned\x07\x1b[31m";

class Escapes : public ProgramTest {
 protected:
    void expect_none(const std::vector<std::string>& arguments, int exit_code,
                     const std::string& shown = "\\x1b]0;owned\\x07\\x1b[31m") const {
        const ProgramRun ran = run(arguments);
        EXPECT_EQ(ran.exit_code, exit_code) << ran.messages;
        for (const std::string& text : {ran.output, ran.messages}) {
            EXPECT_THAT(text, Not(HasSubstr("\x1b")));
            EXPECT_THAT(text, Not(HasSubstr("\x07")));
        }
        EXPECT_THAT(ran.output + ran.messages, HasSubstr(shown));
    }
    std::string nrrd(const std::string& more) const {
        return "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n" + more +
               "\n12345678";
    }
};

TEST_F(Escapes, OfFileNames) {
    const std::string name = "a" + kEscape + ".nrrd";
    expect_none({"info", file(name).string()}, 1); // absent
    write(name, nrrd(""));
    expect_none({"info", file(name).string()}, 0); // the warnings name it
    expect_none({"convert", file(name).string(), file(kEscape + ".xyz").string()}, 1);
    expect_none({"compare", file(name).string(), file(kEscape + ".ply").string()}, 1);
}

TEST_F(Escapes, OfHeaders) {
    write("v.nrrd", nrrd("space: " + kEscape + "\n"));
    expect_none({"info", file("v.nrrd").string()}, 0); // a warning quotes it
    write("v.nhdr",
          "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: " +
              kEscape + "\n");
    expect_none({"info", file("v.nhdr").string()}, 1);
    write("v.mhd", "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = " + kEscape +
                       "\nElementDataFile = LOCAL\n12345678");
    expect_none({"info", file("v.mhd").string()}, 1);
    write("s.json",
          "{\"volume\": \""
          "\\u001b]0;owned\\u0007\\u001b[31m"
          "\"}");
    expect_none({"render", file("s.json").string(), "-o", file("p.png").string()}, 1);
}

// The text fields of NIfTI-1 and the bytes that name its kind and types.
TEST_F(Escapes, OfNiftiHeaders) {
    const std::string good = io::NiftiBytes(1).with(std::string(24, 'x'));
    for (const auto& [at, length] : {std::pair<size_t, size_t>{4, 10}, // data_type
                                     {14, 18},                         // db_name
                                     {148, 80},                        // descrip
                                     {228, 24},                        // aux_file
                                     {328, 16}}) {                     // intent_name
        std::string bytes = good;
        const std::string text = (kEscape + kEscape).substr(0, length);
        bytes.replace(at, text.size(), text);
        write("v.nii", bytes);
        expect_none({"info", file("v.nii").string()}, 0, "3 x 2 x 2");
    }
    for (const size_t at : {0, 40, 70, 72, 76, 108, 123, 252, 344}) { // what is looked at
        std::string bytes = good;
        bytes.replace(at, 4, kEscape.substr(0, 4));
        write("v.nii", bytes);
        const ProgramRun ran = run({"info", file("v.nii").string()});
        EXPECT_THAT(ran.output + ran.messages, Not(HasSubstr("\x1b"))) << at;
        EXPECT_LE(ran.exit_code, 1) << at;
    }
}

TEST_F(Escapes, OfTheModality) {
    std::filesystem::create_directory(file("slices"));
    write("slices/slices.json",
          R"({"pattern": "s%d.raw", "size": [2, 2], "type": "u8", "spacing_mm": [1, 1, 1],
              "modality": "\u001b]0;owned\u0007\u001b[31m"})");
    write("slices/s1.raw", "1234");
    expect_none({"info", file("slices").string()}, 0);
    const ProgramRun json = run({"info", "--json", file("slices").string()});
    EXPECT_EQ(nlohmann::json::parse(json.output)["modality"], kEscape);
    EXPECT_THAT(json.output, Not(HasSubstr("\x1b")));
}

TEST_F(Escapes, OfTheCommandLine) {
    expect_none({"info", "--frame", kEscape, "v.nii"}, 2);
    expect_none({"info", "v.nii", kEscape}, 2);
}

} // namespace
} // namespace palpate
