# Packages are hidden by CMake. Programs and libraries that are looked for by find_program, find_path
# and find_library cannot be: whoever asks leaves an entry in the cache.
file(REMOVE_RECURSE ${WORK})
set(hidden "")
foreach(package ${HIDDEN})
    list(APPEND hidden -DCMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
endforeach()
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK} -G ${GENERATOR}
                        -DCMAKE_CXX_COMPILER=${COMPILER} -D${OPTION} ${hidden}
                OUTPUT_VARIABLE said ERROR_VARIABLE said RESULT_VARIABLE code)
if(NOT code EQUAL 0)
    message(FATAL_ERROR "${said}")
endif()
file(STRINGS ${WORK}/CMakeCache.txt asked REGEX "^(${ASKED})[^:]*:")
list(FILTER asked EXCLUDE REGEX "^CMAKE_DISABLE_FIND_PACKAGE_")
if(asked)
    message(FATAL_ERROR "expected nothing that ${OPTION} leaves out, found ${asked}")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK} --target help
                OUTPUT_VARIABLE targets RESULT_VARIABLE code)
foreach(target ${TARGETS})
    if(NOT targets MATCHES "${target}")
        message(FATAL_ERROR "expected the library ${target}, found ${targets}")
    endif()
endforeach()
