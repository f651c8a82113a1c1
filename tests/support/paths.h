#pragma once

// The paths of this checkout, its data and its build. One object file alone knows them, so that the
// others are the same in every checkout and a compiler cache keeps them.
extern const char* const kSourceDir;  // the top of the checkout
extern const char* const kSharedData; // the folder of real test data; it may be absent
extern const char* const kProgram;    // the program palpate
