# Shaders: GLSL is compiled to SPIR-V, validated, and embedded in the library as words. spirv-opt would
# make pipelines sooner and is left out: llvmpipe 22.3 then draws volumes in parts wrong
# (docs/log/rendering.md).

find_program(GLSLANG_VALIDATOR glslangValidator REQUIRED)
find_program(SPIRV_VAL spirv-val REQUIRED)

add_executable(embed_spirv ${PROJECT_SOURCE_DIR}/cmake/embed_spirv.cpp)
target_compile_features(embed_spirv PRIVATE cxx_std_20)
target_link_libraries(embed_spirv PRIVATE palpate_warnings fmt::fmt)
set_target_properties(embed_spirv PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/cmake)

include(PalpateNative)

# palpate_embed_shader(<target> <shader> <id> [NATIVE] [<macro> ...] [FOLDED <macro> ...])
# Compiles shaders/<shader> once for each combination of its macros being 0 or 1, and adds to
# <target> the words, what cmake/embed_spirv.cpp reads from them, and the header "spirv/<id>.h" with
# `palpate::spirv::<Id>`: macros and specialization constants by name. In <id>_<n>.spv, exactly
# macro i (counted from 0) is 1 for n = 2^i. With NATIVE, its kernels for the processor are built in
# too (PalpateNative.cmake). One kernel serves both values of a macro that stands behind FOLDED as well: its source
# is compiled with the macro being 1 and with <macro>_ID, the id of a specialization constant that says
# whether it is.
function(palpate_embed_shader target shader id)
    set(out_dir ${CMAKE_CURRENT_BINARY_DIR}/spirv)
    file(MAKE_DIRECTORY ${out_dir})
    cmake_path(ABSOLUTE_PATH shader BASE_DIRECTORY ${PROJECT_SOURCE_DIR}/shaders OUTPUT_VARIABLE source)
    cmake_parse_arguments(PARSE_ARGV 3 ARG "NATIVE" "" "FOLDED")
    set(macro_names ${ARG_UNPARSED_ARGUMENTS})
    list(LENGTH macro_names macro_count)
    math(EXPR count "1 << ${macro_count}")
    math(EXPR last "${count} - 1")
    set(all_spv "")
    foreach(variant RANGE ${last})
        set(macros "")
        set(bit 1)
        foreach(macro ${macro_names})
            math(EXPR on "(${variant} / ${bit}) % 2")
            list(APPEND macros -D${macro}=${on})
            math(EXPR bit "${bit} * 2")
        endforeach()
        set(spv ${out_dir}/${id}_${variant}.spv)
        add_custom_command(
            OUTPUT ${spv}
            COMMAND ${GLSLANG_VALIDATOR} --quiet -V --target-env vulkan1.3
                    -I${PROJECT_SOURCE_DIR} ${macros} --depfile ${spv}.d -o ${spv} ${source}
            COMMAND ${SPIRV_VAL} --target-env vulkan1.3 --scalar-block-layout ${spv}
            DEPENDS ${source} DEPFILE ${spv}.d COMMENT "SPIR-V ${id} ${variant}" VERBATIM)
        list(APPEND all_spv ${spv})
    endforeach()
    add_custom_command(
        OUTPUT ${out_dir}/${id}.cpp ${out_dir}/${id}.h
        COMMAND embed_spirv ${source} ${PROJECT_SOURCE_DIR} ${out_dir} ${id} ${macro_names}
        DEPENDS ${all_spv} embed_spirv COMMENT "Embedding ${id}" VERBATIM)
    target_sources(${target} PRIVATE ${out_dir}/${id}.cpp ${out_dir}/${id}.h)
    # all of them use the same names
    set_source_files_properties(${out_dir}/${id}.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR})
    if(ARG_NATIVE)
        palpate_native_kernels(${target} ${source} ${id} "${macro_names}" "${ARG_FOLDED}")
    endif()
endfunction()
