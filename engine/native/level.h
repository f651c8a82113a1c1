#pragma once

#include <string>

namespace palpate::native {

// Kernels run with the widest instruction set that the processor has, that the program holds them
// for, and that is no wider than what the environment variable PALPATE_NATIVE_LEVEL names: sse2,
// avx2 or avx512. This says why the variable cannot be followed; it is empty where it can.
std::string level_refusal();

} // namespace palpate::native
