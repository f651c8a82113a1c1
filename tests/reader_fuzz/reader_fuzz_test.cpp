// PALPATE_FUZZ_COUNT damaged files of every reader: a result, or a sentence with a cause.

#include <gtest/gtest.h>

#include <cstdlib>

#include "engine/base/printable.h"
#include "tests/reader_fuzz/harness.h"
#include "tests/support/given.h"
#include "tests/support/temporary_folder.h"

namespace palpate::fuzz {

// For gtest, which else prints the bytes.
void PrintTo(const Reader& reader, std::ostream* out);
void PrintTo(const Reader& reader, std::ostream* out) {
    *out << reader.name;
}

namespace {

std::vector<Reader> all_readers() {
    std::vector<Reader> all;
    for (auto* const table :
         {volume_readers, dicom_readers, sandboxed_readers, mesh_readers, text_readers})
        for (Reader& reader : table())
            all.push_back(std::move(reader));
    return all;
}

// DamagedFiles takes over 5 s of a processor: each reader meets 300 files, and some start a child
// for each of 18.
class DamagedFiles : public TemporaryFolder, public testing::WithParamInterface<Reader> {};

TEST_P(DamagedFiles, EndInAResultOrACause) {
    // 10^4 of every reader where there is time; else fewer where each file starts a child, but each
    // kind of damage twice.
    const auto count = uint64_t(given("PALPATE_FUZZ_COUNT", GetParam().in_child ? 18 : 300));
    const Outcomes outcomes = meet_damaged_files(GetParam(), count, file(""));
    // A reader that takes everything, or that refuses everything, was not tried.
    EXPECT_GT(outcomes.refused, count / 10);
    EXPECT_TRUE(outcomes.read > 0 || count < 100);
    RecordProperty("read", static_cast<int>(outcomes.read));
    RecordProperty("refused", static_cast<int>(outcomes.refused));
    RecordProperty("died", static_cast<int>(outcomes.died));
    if (!std::getenv("PALPATE_FUZZ_SAY")) // for those who look into the messages
        return;
    std::printf("%s: %zu read, %zu refused, %zu died\n", GetParam().name.c_str(),
                size_t{outcomes.read}, size_t{outcomes.refused}, size_t{outcomes.died});
    for (const auto& [kind, times] : outcomes.why)
        std::printf("%8zu %s\n", size_t{times},
                    printable(outcomes.examples.at(kind)).substr(0, 200).c_str());
}

INSTANTIATE_TEST_SUITE_P(Of, DamagedFiles, testing::ValuesIn(all_readers()),
                         [](const auto& reader) { return reader.param.name; });

TEST(Damage, IsTheSameForTheSameSeed) {
    const std::string whole(1000, 'x');
    EXPECT_EQ(damaged(whole, 7), damaged(whole, 7));
    int changed = 0;
    for (uint64_t seed = 0; seed < 100; ++seed)
        changed += damaged(whole, seed) != whole;
    EXPECT_GT(changed, 95);
}

TEST(Damage, EveryKindComesInTurn) {
    const std::string whole = "0123456789abcdefghijklmnopqrstuvwxyz";
    for (uint64_t first = 0; first < 90; first += 9) {
        int cut = 0; // and no more
        for (uint64_t i = 0; i < 9; ++i)
            cut += whole.starts_with(damaged(whole, (first + i) * 1000003 + 5));
        EXPECT_GE(cut, 1);
        EXPECT_LE(cut, 3); // a file that was cut may be changed behind its end
    }
}

TEST(Damage, FaultsOfMessagesAreSeen) {
    EXPECT_EQ(fault_of("/tmp/a.nii: expected 3 bytes, found 2", "/tmp/a.nii"), "");
    EXPECT_NE(fault_of("expected 3 bytes, found 2", "/tmp/a.nii"), "");
    EXPECT_NE(fault_of("/tmp/a.nii: expected 3 bytes,\nfound 2", "/tmp/a.nii"), "");
    EXPECT_NE(fault_of("/tmp/a.nii: failed", "/tmp/a.nii"), "");
    EXPECT_NE(fault_of("/tmp/a.nii: cannot be read: std::exception", "/tmp/a.nii"), "");
}

} // namespace
} // namespace palpate::fuzz
