# Installs the build into a folder of its own, builds the consumer and examples/ against it, and runs
# the consumer.
#
# cmake -DBUILD=<build folder> -DSOURCE=<checkout> -DWORK=<scratch folder> -DFLAGS=<compiler flags>
#       -DGENERATOR=<...> -DCOMPILER=<...> -DLAUNCHER=<ccache or nothing> -P run.cmake
set(prefix ${WORK}/prefix)
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})

execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix}
                OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)

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

foreach(project tests/install/consumer examples)
    execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE}/${project} -B ${WORK}/build/${project}
                            -G ${GENERATOR} -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_BUILD_TYPE=Release
                            -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS}
                            -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
                    COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK}/build/${project}
                    COMMAND_ERROR_IS_FATAL ANY)
endforeach()

# Reading a file starts the installed program as its decoder, which is looked for on the PATH.
set(ENV{PATH} "${prefix}/bin:$ENV{PATH}")
execute_process(COMMAND ${WORK}/build/tests/install/consumer/consumer ${WORK} COMMAND_ERROR_IS_FATAL ANY)
foreach(file head.nii.gz head.png)
    if(NOT EXISTS ${WORK}/${file})
        message(FATAL_ERROR "expected the consumer to write ${file}")
    endif()
endforeach()
file(REMOVE_RECURSE ${WORK})
