// palpate-bench: the suites of `palpate bench`, a program of their own, which that command starts.

#include "engine/program/program.h"

int main(int argc, char** argv) {
    constexpr palpate::ProgramCommand kCommands[] = {
        {"bench", "Measure speed beside error", palpate::add_bench_suites}};
    return palpate::run_program(argc, argv, kCommands);
}
