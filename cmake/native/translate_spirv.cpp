// translate_spirv OPTIMISED OUT VECTORS (NAME MODULE NUMBER)...
//
// Run by palpate_embed_shader() (PalpateShaders.cmake). Writes the C++ of a compute shader: of
// OPTIMISED, in which all functions are inlined and each has one return, for the device that runs
// the words of each MODULE on the processor (engine/native). NAME is the kernel's in C++. Modules
// differ in macros that OPTIMISED has as constants: bit i of a module's NUMBER is the value of
// constant kFirstFolded + i. A kernel without barriers runs as many lanes at a time as VECTORS
// vectors of the processor hold.
//
// Exit 0 when done, else 1 with a sentence.
#include <algorithm>
#include <cstdlib>
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
    const int first = 4;
    if (argc < first + 3 || (argc - first) % 3 != 0)
        translator::fail("expected OPTIMISED OUT VECTORS (NAME MODULE NUMBER)...");
    const auto number = [&](int i) {
        return static_cast<uint32_t>(std::strtoul(argv[i], nullptr, 10));
    };
    std::vector<translator::Served> served;
    for (int i = first; i < argc; i += 3) {
        const translator::Words words = read(argv[i + 1]);
        served.push_back({argv[i], palpate::native::hash_of(words), number(i + 2),
                          translator::bindings_of(words)});
    }
    std::string text;
    try {
        const translator::Module module = translator::parse(read(argv[1]));
        text = translator::Translator(module, served, number(3)).run();
    } catch (const std::exception& error) {
        translator::fail("{}: {}", argv[1], error.what());
    }
    std::ofstream file(argv[2], std::ios::binary);
    if (!(file << text << std::flush))
        translator::fail("{}: cannot be written", argv[2]);
    return 0;
} catch (const std::exception& error) {
    fmt::print(stderr, "translate_spirv: {}\n", error.what());
    return 1;
}
