# Installs the build into a folder of its own, builds the consumer and examples/ against it, and runs
# the consumer.
#
# cmake -DBUILD=<build folder> -DSOURCE=<checkout> -DWORK=<scratch folder> -DFLAGS=<compiler flags>
#       -DGENERATOR=<...> -DCOMPILER=<...> -DLAUNCHER=<ccache or nothing> -P run.cmake
set(prefix ${WORK}/prefix)
set(other ${WORK}/other)
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})

# Two prefixes, neither of which is the configured one.
foreach(folder ${prefix} ${other})
    execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${folder}
                    OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
endforeach()

# What is installed may not lean on the folders it was built in.
file(GLOB_RECURSE package_files ${prefix}/lib*/cmake/palpate/*.cmake)
if(NOT package_files)
    message(FATAL_ERROR "${prefix}: expected palpate's CMake package, found none")
endif()
foreach(file ${package_files})
    file(READ ${file} text)
    string(REPLACE "${prefix}" "" text "${text}")
    foreach(folder ${BUILD} ${SOURCE})
        string(REGEX REPLACE "([][+.*()^$?|])" "\\\\\\1" pattern "${folder}")
        if(text MATCHES "[\";: ]${pattern}[/\";> ]")
            message(FATAL_ERROR "${file}: names the folder ${folder}")
        endif()
    endforeach()
endforeach()

# Builds a project of SOURCE against what is installed in `from`, in WORK/name.
function(build project from name)
    execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE}/${project} -B ${WORK}/${name}
                            -G ${GENERATOR} -DCMAKE_PREFIX_PATH=${from} -DCMAKE_BUILD_TYPE=Release
                            -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS}
                            -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
                    OUTPUT_VARIABLE said ERROR_VARIABLE said COMMAND_ERROR_IS_FATAL ANY)
    if(said MATCHES "does not exist")
        message(FATAL_ERROR "find_package(palpate) scares its users:\n${said}")
    endif()
    execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK}/${name} ${ARGN}
                    COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# What a program takes as its decoder.
function(expect_decoder expected)
    execute_process(COMMAND ${ARGN} OUTPUT_VARIABLE said COMMAND_ERROR_IS_FATAL ANY)
    if(NOT said MATCHES "decoder: ([^\n]*)\n" OR NOT CMAKE_MATCH_1 STREQUAL expected)
        message(FATAL_ERROR "${ARGN}: expected the decoder ${expected}, found:\n${said}")
    endif()
endfunction()

build(tests/install/consumer ${prefix} consumer)
build(examples ${prefix} examples)
build(tests/install/consumer ${other} consumer_of_other --target uses_reader)

execute_process(COMMAND ${WORK}/consumer/whole OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
# Headers that docs/api.md does not name are the libraries' own.
foreach(private engine/segment/kernel.h engine/render/frame_block.h engine/decode/serve.h haptics/field/four.h)
    if(EXISTS ${prefix}/include/palpate/${private})
        message(FATAL_ERROR "${private}: expected not to be installed")
    endif()
endforeach()

# Reading a file starts the program of the prefix where CMake found the package; no other is on PATH.
set(ENV{PATH} /usr/bin:/bin)
expect_decoder(${prefix}/bin/palpate ${WORK}/consumer/consumer ${WORK})
foreach(file head.nii.gz head.png)
    if(NOT EXISTS ${WORK}/${file})
        message(FATAL_ERROR "expected the consumer to write ${file}")
    endif()
endforeach()
expect_decoder(${prefix}/bin/palpate ${WORK}/consumer/uses_reader)
expect_decoder(${other}/bin/palpate ${WORK}/consumer_of_other/uses_reader)
# A program or a library in a prefix takes that of the prefix, wherever it was built and moved.
file(COPY ${WORK}/consumer/consumer DESTINATION ${other}/libexec)
expect_decoder(${other}/bin/palpate ${other}/libexec/consumer ${WORK})
file(RENAME ${prefix} ${WORK}/moved)
foreach(folder lib lib/x86_64-linux-gnu)
    file(COPY ${WORK}/consumer/libreader.so DESTINATION ${WORK}/moved/${folder})
    expect_decoder(${WORK}/moved/bin/palpate
                   ${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${WORK}/moved/${folder}
                   ${CMAKE_COMMAND} -E env ${WORK}/consumer_of_other/uses_reader)
endforeach()
file(REMOVE_RECURSE ${WORK})
