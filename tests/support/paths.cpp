#include "tests/support/paths.h"

const char* const kSourceDir = PALPATE_SOURCE_DIR;
const char* const kSharedData = PALPATE_SHARED_DATA;
const char* const kProgram = PALPATE_PROGRAM;
