#pragma once

// Include before any header of ITK. Debian's ITK 5.2 was configured with g++ alone, and its headers
// refuse every other compiler. clang understands the same language: it passes for g++ 12 while ITK
// looks, and for itself again after. ITK 5.4 looks no longer, and has no such header.
#if defined(__clang__) && __has_include(<itk_compiler_detection.h>)
#pragma push_macro("__clang__")
#pragma push_macro("__GNUC__")
#undef __clang__
#undef __GNUC__
#define __GNUC__ 12
#include <itk_compiler_detection.h>
#pragma pop_macro("__GNUC__")
#pragma pop_macro("__clang__")
#endif
