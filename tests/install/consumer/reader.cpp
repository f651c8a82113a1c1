#include "engine/io/sandbox.h"

const char* decoder_of_reader() {
    static const std::string path = palpate::io::decoder_program();
    return path.c_str();
}
