// translate_spirv MODULE OPTIMISED NAME OUT
//
// Run by palpate_embed_shader() (PalpateShaders.cmake). Writes the C++ of a compute shader: of
// OPTIMISED, in which all functions are inlined and each has one return, for the device that runs
// MODULE's words on the processor (engine/native). NAME is the kernel's in C++.
//
// Exit 0 when done, else 1 with a sentence.
#include <algorithm>
#include <fstream>
#include <iterator>

#include "engine/native/kernel.h"
#include "translator.h"

namespace {

translator::Words read(const char* path) {
    std::ifstream file(path, std::ios::binary);
    if (!file)
        translator::fail("{}: cannot be read", path);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    translator::Words words(bytes.size() / 4);
    std::copy_n(bytes.data(), 4 * words.size(), reinterpret_cast<char*>(words.data()));
    return words;
}

} // namespace

int main(int argc, char** argv) try {
    if (argc != 5)
        translator::fail("expected MODULE OPTIMISED NAME OUT");
    const uint64_t hash = palpate::native::hash_of(read(argv[1]));
    std::string text;
    try {
        const translator::Module module = translator::parse(read(argv[2]));
        text = translator::Translator(module, argv[3], hash).run();
    } catch (const std::exception& error) {
        translator::fail("{}: {}", argv[2], error.what());
    }
    std::ofstream file(argv[4], std::ios::binary);
    if (!(file << text << std::flush))
        translator::fail("{}: cannot be written", argv[4]);
    return 0;
} catch (const std::exception& error) {
    fmt::print(stderr, "translate_spirv: {}\n", error.what());
    return 1;
}
