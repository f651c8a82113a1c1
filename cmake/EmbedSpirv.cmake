# cmake -DID=<name> -DCOUNT=<n> -DOUT=<folder> -P EmbedSpirv.cmake
# Writes <folder>/<name>.{h,cpp} holding the words of <folder>/<name>_0.spv .. <name>_<n-1>.spv.
math(EXPR last "${COUNT} - 1")
set(arrays "")
set(spans "")
foreach(i RANGE ${last})
    file(READ ${OUT}/${ID}_${i}.spv hex HEX)
    string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1u," words "${hex}")
    string(APPEND arrays "static constexpr uint32_t kWords${i}[] = {\n${words}\n};\n")
    string(APPEND spans "kWords${i}, ")
endforeach()
file(WRITE ${OUT}/${ID}.h "#pragma once
#include <array>
#include <cstdint>
#include <span>
namespace palpate::spirv { extern const std::array<std::span<const uint32_t>, ${COUNT}> ${ID}; }
")
file(WRITE ${OUT}/${ID}.cpp "#include \"${ID}.h\"
namespace palpate::spirv {
${arrays}
const std::array<std::span<const uint32_t>, ${COUNT}> ${ID}{${spans}};
} // namespace palpate::spirv
")
