# Installs the bundle into a folder of its own, moves that, and runs it from another folder.
#
# cmake -DBUILD=<build folder> -DWORK=<scratch folder> -P run.cmake
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK}/elsewhere)
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --component bundle
                        --prefix ${WORK}/installed
                OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(RENAME ${WORK}/installed ${WORK}/moved)
set(palpate ${WORK}/moved/bin/palpate)

unset(ENV{LD_LIBRARY_PATH})
execute_process(COMMAND ${palpate} doctor WORKING_DIRECTORY ${WORK}/elsewhere
                OUTPUT_VARIABLE said COMMAND_ERROR_IS_FATAL ANY)
if(NOT said MATCHES "chosen by default")
    message(FATAL_ERROR "expected palpate doctor to choose a device, found:\n${said}")
endif()
execute_process(COMMAND ${palpate} render "synthetic:ball?size=16" --size 16,16 -o ball.png
                WORKING_DIRECTORY ${WORK}/elsewhere COMMAND_ERROR_IS_FATAL ANY)

# Of the machine's own libraries, it takes those of the compiler and of glibc, and no other.
foreach(program palpate golden_test)
    execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_TRACE_LOADED_OBJECTS=1
                            ${WORK}/moved/bin/${program}
                    OUTPUT_VARIABLE loaded COMMAND_ERROR_IS_FATAL ANY)
    string(REGEX MATCHALL "[^\n\t ]+ => [^\n]*" lines "${loaded}")
    set(own 0)
    foreach(line ${lines})
        if(line MATCHES "=> ${WORK}/moved/")
            math(EXPR own "${own} + 1")
        elseif(NOT line MATCHES "^(libc|libm|libdl|librt|libpthread|libmvec|libgcc_s|libstdc\\+\\+)\\.so")
            message(FATAL_ERROR "${program}: expected a library of the bundle, found ${line}")
        endif()
    endforeach()
    if(own LESS 10)
        message(FATAL_ERROR "${program}: expected the bundle's libraries, found ${own}:\n${loaded}")
    endif()
endforeach()
foreach(file lib/libvulkan.so.1 lib/fallback/libstdc++.so.6 share/palpate/golden/mip/expected.exr
        bin/gpu-report)
    if(NOT EXISTS ${WORK}/moved/${file})
        message(FATAL_ERROR "expected ${file} in the bundle")
    endif()
endforeach()
file(REMOVE_RECURSE ${WORK})
