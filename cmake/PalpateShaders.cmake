# Shaders: GLSL is compiled to SPIR-V, validated, and embedded in the library as words. spirv-opt would
# make pipelines sooner and is left out: llvmpipe 22.3 then draws volumes in parts wrong
# (docs/log/rendering.md).

find_program(GLSLANG_VALIDATOR glslangValidator REQUIRED)
find_program(SPIRV_VAL spirv-val REQUIRED)

# palpate_embed_shader(<target> <shader> <id> [<macro> ...])
# Compiles shaders/<shader> once for each combination of its macros being 0 or 1, and adds to
# <target> a source with `palpate::spirv::<id>`, an array of spans, and the header "spirv/<id>.h".
# The variant in which exactly macro i (counted from 0) is 1 stands at index 2^i.
function(palpate_embed_shader target shader id)
    set(out_dir ${CMAKE_CURRENT_BINARY_DIR}/spirv)
    file(MAKE_DIRECTORY ${out_dir})
    set(source ${PROJECT_SOURCE_DIR}/shaders/${shader})
    list(LENGTH ARGN macro_count)
    math(EXPR count "1 << ${macro_count}")
    math(EXPR last "${count} - 1")
    set(all_spv "")
    foreach(variant RANGE ${last})
        set(macros "")
        set(bit 1)
        foreach(macro ${ARGN})
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
        COMMAND ${CMAKE_COMMAND} -DID=${id} -DCOUNT=${count} -DOUT=${out_dir}
                -P ${PROJECT_SOURCE_DIR}/cmake/EmbedSpirv.cmake
        DEPENDS ${all_spv} ${PROJECT_SOURCE_DIR}/cmake/EmbedSpirv.cmake
        COMMENT "Embedding ${id}" VERBATIM)
    target_sources(${target} PRIVATE ${out_dir}/${id}.cpp ${out_dir}/${id}.h)
    target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR})
endfunction()
