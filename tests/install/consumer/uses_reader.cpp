#include <cstdio>

const char* decoder_of_reader();

int main() {
    std::printf("decoder: %s\n", decoder_of_reader());
}
