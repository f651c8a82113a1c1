# Builds the codecs with clang's fuzzer and the address sanitizer, and gives them 10^7 inputs.
#
# cmake -DSOURCE=<checkout> -DWORK=<scratch folder> -DCLANG=<clang++> -P run.cmake
file(MAKE_DIRECTORY ${WORK})
execute_process(
    COMMAND ${CLANG} -std=c++20 -O1 -g -fsanitize=fuzzer,address -I${SOURCE}
            ${SOURCE}/tests/codec_fuzz/codec_fuzz.cpp ${SOURCE}/haptics/device/falcon/codec.cpp
            ${SOURCE}/haptics/device/spacemouse/codec.cpp ${SOURCE}/haptics/device/wooden/codec.cpp
            -o ${WORK}/codec_fuzz
    COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${WORK}/codec_fuzz -runs=10000000 -max_len=96 -seed=1
                WORKING_DIRECTORY ${WORK} COMMAND_ERROR_IS_FATAL ANY)
