#pragma once

#include "engine/decode/formats.h"

namespace palpate::io {

// The child's side (see sandbox.h): limits itself, decodes with `decode`, reports, and ends the
// process without running destructors. For a program's main(), before anything else:
//     if (argc > 1 && std::string_view(argv[1]) == "__decode")
//         palpate::io::serve_decoding(argc, argv);
[[noreturn]] void serve_decoding(int argc, char** argv, Decode decode = decode_any);

} // namespace palpate::io
