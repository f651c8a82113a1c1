#include "tests/reader_fuzz/harness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <random>

#include "engine/base/printable.h"

namespace palpate::fuzz {

namespace {

// The same numbers everywhere, which the distributions of the standard library do not promise.
class Random {
 public:
    explicit Random(uint64_t seed) : engine_(seed) {}
    uint64_t below(uint64_t end) { return end == 0 ? 0 : engine_() % end; }
    bool one_in(uint64_t n) { return below(n) == 0; }

 private:
    std::mt19937_64 engine_;
};

// Headers are where most is to be broken.
size_t place(Random& random, size_t size) {
    return random.one_in(2) ? random.below(size) : random.below(std::min<size_t>(size, 400));
}

void overwrite(std::string& bytes, size_t at, const std::string& with) {
    for (size_t i = 0; i < with.size() && at + i < bytes.size(); ++i)
        bytes[at + i] = with[i];
}

// A number that sizes and offsets should not be, of 1, 2, 4 or 8 bytes in either order.
std::string number(Random& random) {
    constexpr uint64_t numbers[] = {0,          1,          0x7f,       0x80,        0xff,
                                    0x7fff,     0x8000,     0xffff,     0x7fffffff,  0x80000000,
                                    0xffffffff, 0x7f800000, 0x7fc00000, 0x100000000, ~uint64_t{0}};
    const uint64_t value = numbers[random.below(std::size(numbers))];
    const size_t size = size_t{1} << random.below(4);
    std::string bytes;
    for (size_t i = 0; i < size; ++i)
        bytes.push_back(static_cast<char>(value >> 8 * i));
    if (random.one_in(2))
        std::reverse(bytes.begin(), bytes.end());
    return bytes;
}

constexpr uint64_t kChanges = 8; // kinds of them

void change(std::string& bytes, uint64_t kind, Random& random) {
    if (bytes.empty())
        return;
    const size_t at = place(random, bytes.size());
    const size_t run = 1 + random.below(16);
    switch (kind) {
        case 0:
            bytes[at] = static_cast<char>(random.below(256));
            break;
        case 1:
            bytes[at] = static_cast<char>(bytes[at] ^ 1 << random.below(8));
            break;
        case 2:
            overwrite(bytes, at, number(random));
            break;
        case 3:
            bytes.erase(at, run);
            break;
        case 4: {
            std::string more;
            for (size_t i = 0; i < run; ++i)
                more.push_back(static_cast<char>(random.below(256)));
            bytes.insert(at, more);
            break;
        }
        case 5:
            bytes.insert(at, bytes.substr(place(random, bytes.size()), run));
            break;
        case 6:
            overwrite(bytes, at, std::string(run, random.one_in(2) ? '\0' : '\xff'));
            break;
        default: { // of text
            constexpr const char* words[] = {"9",    "-1",  "0",  "99999999999", "1e308", "nan",
                                             "-inf", "0.5", "\n", " ",           "\"",    "\x1b["};
            const size_t digit = bytes.find_first_of("0123456789", at);
            const char* const word = words[random.below(std::size(words))];
            if (digit != std::string::npos)
                bytes.replace(digit, 1, word);
        }
    }
}

// A message without what differs from file to file.
std::string kind_of(const std::string& message, const std::filesystem::path& path) {
    std::string kind = message;
    for (size_t at; (at = kind.find(path.string())) != std::string::npos;)
        kind.replace(at, path.string().size(), "FILE");
    std::string out;
    bool quoted = false;
    for (const char c : kind) {
        quoted = quoted != (c == '"');
        const bool is_digit = std::isdigit(static_cast<unsigned char>(c)) != 0;
        if (quoted ? c == '"' : !is_digit || !out.ends_with('#'))
            out.push_back(is_digit ? '#' : c);
    }
    return out.substr(0, 100);
}

bool has_died(const std::string& message) {
    for (const char* words : {"the reader crashed", "reader gave up", "ended without a result"})
        if (message.find(words) != std::string::npos)
            return true;
    return false;
}

} // namespace

std::string damaged(const std::string& bytes, uint64_t seed) {
    Random random(seed);
    std::string changed = bytes;
    const uint64_t kind = seed % (kChanges + 1); // the last: cut short, no more
    if (kind == kChanges || random.one_in(4))
        changed.resize(random.one_in(4)
                           ? changed.size() - std::min<size_t>(changed.size(), random.below(20))
                           : place(random, changed.size()));
    if (kind == kChanges)
        return changed;
    change(changed, kind, random);
    for (uint64_t n = random.below(4); n > 0; --n)
        change(changed, random.below(kChanges), random);
    return changed;
}

std::string fault_of(const std::string& message, const std::filesystem::path& path) {
    const std::string name = path.filename().string();
    const size_t at = message.rfind(name);
    if (at == std::string::npos)
        return "does not name the file";
    if (message.find('\n') != std::string::npos)
        return "has more than one line";
    if (std::count(message.begin(), message.end(), ' ') < 3)
        return "names no cause";
    for (const char* words :
         {"nknown error", "nknown exception", "basic_string", "vector::", "bad_alloc", "std::"})
        if (message.find(words) != std::string::npos)
            return "speaks of the program, not of the file";
    return "";
}

Outcomes meet_damaged_files(const Reader& reader, uint64_t count,
                            const std::filesystem::path& folder) {
    Outcomes outcomes;
    const std::filesystem::path path = folder / reader.file_name;
    const auto write = [&](const std::string& bytes) {
        std::filesystem::remove(path); // ext4 flushes a file that is cut short and rewritten
        std::ofstream(path, std::ios::binary) << bytes;
    };
    for (const std::string& seed : reader.seeds) {
        write(seed);
        const std::optional<Error> error = reader.read(path);
        EXPECT_FALSE(error) << reader.name << ": a valid file is refused: " << error->message;
    }
    for (uint64_t i = 0; i < count && !testing::Test::HasFailure(); ++i) {
        SCOPED_TRACE(reader.name + ", damage " + std::to_string(i));
        const std::string& whole = reader.seeds[i % reader.seeds.size()];
        std::string bytes = damaged(whole, i * 1000003 + reader.name.size());
        write(reader.sign ? reader.sign(std::move(bytes)) : bytes);
        const std::optional<Error> error = reader.read(path);
        ++(error ? outcomes.refused : outcomes.read);
        if (!error)
            continue;
        const std::string& message = error->message;
        EXPECT_EQ(fault_of(message, path), "") << message;
        const std::string kind = kind_of(message, path);
        ++outcomes.why[kind];
        outcomes.examples.try_emplace(kind, message);
        outcomes.died += has_died(message);
        EXPECT_TRUE(reader.may_die || !has_died(message)) << message;
    }
    return outcomes;
}

} // namespace palpate::fuzz
