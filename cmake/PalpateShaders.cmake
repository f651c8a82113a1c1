# Shaders: GLSL is compiled to SPIR-V, validated, and embedded in the library as words.

find_program(GLSLANG_VALIDATOR glslangValidator REQUIRED)
find_program(SPIRV_VAL spirv-val REQUIRED)

# palpate_embed_shader(<target> <shader> <id> [<macro>=<value> ...])
# Compiles shaders/<shader> with the macros and adds to <target> a source with
# `extern const std::span<const uint32_t> palpate::spirv::<id>` and the header "spirv/<id>.h".
function(palpate_embed_shader target shader id)
    set(out_dir ${CMAKE_CURRENT_BINARY_DIR}/spirv)
    file(MAKE_DIRECTORY ${out_dir})
    set(source ${PROJECT_SOURCE_DIR}/shaders/${shader})
    set(spv ${out_dir}/${id}.spv)
    list(TRANSFORM ARGN PREPEND -D OUTPUT_VARIABLE macros)
    add_custom_command(
        OUTPUT ${spv}
        COMMAND ${GLSLANG_VALIDATOR} --quiet -V --target-env vulkan1.3
                -I${PROJECT_SOURCE_DIR} ${macros} --depfile ${spv}.d -o ${spv} ${source}
        COMMAND ${SPIRV_VAL} --target-env vulkan1.3 --scalar-block-layout ${spv}
        DEPENDS ${source} DEPFILE ${spv}.d COMMENT "SPIR-V ${id}" VERBATIM)
    add_custom_command(
        OUTPUT ${out_dir}/${id}.cpp ${out_dir}/${id}.h
        COMMAND ${CMAKE_COMMAND} -DSPV=${spv} -DID=${id} -DOUT=${out_dir}
                -P ${PROJECT_SOURCE_DIR}/cmake/EmbedSpirv.cmake
        DEPENDS ${spv} ${PROJECT_SOURCE_DIR}/cmake/EmbedSpirv.cmake
        COMMENT "Embedding ${id}" VERBATIM)
    target_sources(${target} PRIVATE ${out_dir}/${id}.cpp ${out_dir}/${id}.h)
    target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR})
endfunction()
