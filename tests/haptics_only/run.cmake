# Packages are hidden by CMake. Programs and libraries that are looked for by find_program, find_path
# and find_library cannot be: whoever asks leaves an entry in the cache.
file(REMOVE_RECURSE ${WORK})
set(hidden "")
foreach(package ITK GDCM VulkanHeaders Vulkan glslang PNG JPEG OpenEXR pugixml LibArchive CLI11 GTest)
    list(APPEND hidden -DCMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
endforeach()
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK} -G ${GENERATOR}
                        -DCMAKE_CXX_COMPILER=${COMPILER} -DPALPATE_HAPTICS_ONLY=ON ${hidden}
                OUTPUT_VARIABLE said ERROR_VARIABLE said RESULT_VARIABLE code)
if(NOT code EQUAL 0)
    message(FATAL_ERROR "${said}")
endif()
file(STRINGS ${WORK}/CMakeCache.txt asked
     REGEX "^(GLSLANG|SPIRV|FOUND_|[^:]*(ITK|GDCM|gdcm|Vulkan)_)[^:]*:" )
list(FILTER asked EXCLUDE REGEX "^CMAKE_DISABLE_FIND_PACKAGE_")
if(asked)
    message(FATAL_ERROR "expected nothing of ITK, GDCM, Vulkan or glslang, found ${asked}")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK} --target help
                OUTPUT_VARIABLE targets RESULT_VARIABLE code)
foreach(library core device field papers proxy safety servo)
    if(NOT targets MATCHES "palpate_haptics_${library}")
        message(FATAL_ERROR "expected the library palpate_haptics_${library}, found ${targets}")
    endif()
endforeach()
