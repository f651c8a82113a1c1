# cmake -DSPV=<file> -DID=<name> -DOUT=<folder> -P EmbedSpirv.cmake
# Writes <folder>/<name>.{h,cpp} holding the words of a SPIR-V file.
file(READ ${SPV} hex HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1u," words "${hex}")
string(REGEX REPLACE "(0x[0-9a-f]+u,0x[0-9a-f]+u,0x[0-9a-f]+u,0x[0-9a-f]+u,)" "\\1\n" words "${words}")
file(WRITE ${OUT}/${ID}.h "#pragma once
#include <cstdint>
#include <span>
namespace palpate::spirv { extern const std::span<const uint32_t> ${ID}; }
")
file(WRITE ${OUT}/${ID}.cpp "#include \"${ID}.h\"
namespace palpate::spirv {
static constexpr uint32_t kWords[] = {
${words}
};
extern const std::span<const uint32_t> ${ID};
const std::span<const uint32_t> ${ID}{kWords};
} // namespace palpate::spirv
")
