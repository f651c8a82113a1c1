# Kernels: compute shaders as native code of the processor, for the device of engine/native. Each
# module of SPIR-V becomes C++ (cmake/native) and is compiled once for each instruction set.

set(PALPATE_NATIVE_LEVELS "" CACHE STRING
    "Instruction sets that kernels are built for, of sse2, avx2 and avx512; empty: this machine's")
find_program(SPIRV_OPT spirv-opt REQUIRED)
# clang compiles kernels in a third of the time that g++ takes.
find_program(PALPATE_KERNEL_COMPILER NAMES clang++ clang++-14 ${CMAKE_CXX_COMPILER})

set(native_levels ${PALPATE_NATIVE_LEVELS})
if(NOT native_levels)
    set(native_levels sse2)
    if(EXISTS /proc/cpuinfo)
        file(STRINGS /proc/cpuinfo native_cpu REGEX "^flags" LIMIT_COUNT 1)
        if(native_cpu MATCHES "avx512f" AND native_cpu MATCHES "avx512vl" AND native_cpu MATCHES "avx512dq" AND
           native_cpu MATCHES "avx512bw")
            set(native_levels avx512)
        elseif(native_cpu MATCHES " avx2" AND native_cpu MATCHES " fma")
            set(native_levels avx2)
        endif()
    endif()
endif()
if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    set(native_levels "")
endif()
set(native_options_sse2 "")
set(native_options_avx2 -mavx2 -mfma -mf16c)
set(native_options_avx512 -mavx512f -mavx512vl -mavx512dq -mavx512bw -mavx2 -mfma
    -mprefer-vector-width=512)
set(native_name_sse2 kSse2)
set(native_name_avx2 kAvx2)
set(native_name_avx512 kAvx512)

# Kernels that run two vectors of lanes at a time: alpha and MIP of a volume alone are faster so, for
# three times the compiler's time (docs/decisions/20-shaders-as-kernels.md).
set(native_doubled ray_cast_12)

file(GLOB translator_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/cmake/native/*.cpp)
add_executable(translate_spirv ${translator_sources})
target_compile_features(translate_spirv PRIVATE cxx_std_20)
target_include_directories(translate_spirv PRIVATE ${PROJECT_SOURCE_DIR})
target_link_libraries(translate_spirv PRIVATE palpate_warnings fmt::fmt Vulkan::Headers)
set_target_properties(translate_spirv PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/cmake)

# palpate_native_object(<target> <source> <object> <level>)
# Compiles C++ over lanes for one instruction set into <target>.
function(palpate_native_object target source object level)
    file(GLOB headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/engine/native/*.h)
    add_custom_command(
        OUTPUT ${object}
        COMMAND ${CMAKE_CXX_COMPILER_LAUNCHER} ${PALPATE_KERNEL_COMPILER} -std=c++20 -O2 -fPIC -w
                -ffp-contract=off ${native_options_${level}} -I${PROJECT_SOURCE_DIR}
                "-I$<JOIN:$<TARGET_PROPERTY:Vulkan::Headers,INTERFACE_INCLUDE_DIRECTORIES>,;-I>"
                -c ${source} -o ${object}
        DEPENDS ${source} ${headers} COMMENT "Kernel ${object}" VERBATIM COMMAND_EXPAND_LISTS)
    target_sources(${target} PRIVATE ${object})
    set_source_files_properties(${object} PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
endfunction()

# palpate_native_kernels(<target> <source> <id> <macros> <folded macros>)
# The kernels of spirv/<id>_0.spv .. (PalpateShaders.cmake); <id>.cpp registers them.
function(palpate_native_kernels target source id macros folded)
    set(folder ${CMAKE_CURRENT_BINARY_DIR}/spirv)
    set(folded_bits 0)
    set(folded_options "")
    set(number 0)
    foreach(macro ${macros})
        if(macro IN_LIST folded)
            math(EXPR folded_bits "${folded_bits} + (1 << ${number})")
            math(EXPR constant "1000 + ${number}") # kFirstFolded of cmake/native/translator.h
            list(APPEND folded_options -D${macro}=1 -D${macro}_ID=${constant})
        endif()
        math(EXPR number "${number} + 1")
    endforeach()
    math(EXPR last "(1 << ${number}) - 1")
    foreach(variant RANGE ${last})
        math(EXPR kernel "${variant} | ${folded_bits}")
        list(APPEND served_${kernel} ${id}_${variant} ${folder}/${id}_${variant}.spv ${variant})
        list(APPEND modules_${kernel} ${folder}/${id}_${variant}.spv)
    endforeach()
    foreach(variant RANGE ${last})
        if(NOT DEFINED served_${variant})
            continue()
        endif()
        set(name ${id}_${variant})
        set(spv ${folder}/${name}.spv)
        if(folded)
            set(spv ${folder}/${name}_folded.spv)
            set(options ${folded_options})
            set(number 0)
            foreach(macro ${macros})
                math(EXPR on "(${variant} >> ${number}) & 1")
                if(NOT macro IN_LIST folded)
                    list(APPEND options -D${macro}=${on})
                endif()
                math(EXPR number "${number} + 1")
            endforeach()
            add_custom_command(
                OUTPUT ${spv}
                COMMAND ${GLSLANG_VALIDATOR} --quiet -V --target-env vulkan1.3
                        -I${PROJECT_SOURCE_DIR} ${options} --depfile ${spv}.d -o ${spv} ${source}
                DEPENDS ${source} DEPFILE ${spv}.d COMMENT "SPIR-V ${name}, folded" VERBATIM)
        endif()
        set(vectors 1)
        if(name IN_LIST native_doubled)
            set(vectors 2)
        endif()
        add_custom_command(
            OUTPUT ${folder}/${name}_native.cpp
            COMMAND ${SPIRV_OPT} -O --merge-return --inline-entry-points-exhaustive
                    --eliminate-dead-functions --ssa-rewrite --simplify-instructions
                    --eliminate-dead-branches --merge-blocks --cfg-cleanup
                    --eliminate-dead-code-aggressive ${spv} -o ${folder}/${name}_native.spv
            COMMAND translate_spirv ${folder}/${name}_native.spv ${folder}/${name}_native.cpp
                    ${vectors} ${served_${variant}}
            DEPENDS ${spv} ${modules_${variant}} translate_spirv COMMENT "Translating ${name}"
            VERBATIM)
        foreach(level ${native_levels})
            palpate_native_object(${target} ${folder}/${name}_native.cpp
                                  ${folder}/${name}_${level}.o ${level})
        endforeach()
    endforeach()
    set(registers "#include \"engine/native/kernel.h\"\nnamespace palpate::native {\n")
    foreach(level ${native_levels})
        set(addresses "")
        string(APPEND registers "namespace ${native_name_${level}} {\n")
        foreach(variant RANGE ${last})
            string(APPEND registers "extern const Kernel ${id}_${variant};\n")
            string(APPEND addresses "&${native_name_${level}}::${id}_${variant}, ")
        endforeach()
        string(APPEND registers "}\nstatic const Registered registered_${id}_${level}("
                                "Level::${native_name_${level}}, {${addresses}});\n")
    endforeach()
    string(APPEND registers "}\n")
    file(CONFIGURE OUTPUT ${folder}/${id}_kernels.h CONTENT "${registers}" @ONLY)
    set_source_files_properties(${folder}/${id}.cpp PROPERTIES
        COMPILE_OPTIONS "-include;${folder}/${id}_kernels.h" OBJECT_DEPENDS ${folder}/${id}_kernels.h)
    target_link_libraries(${target} PRIVATE palpate_native)
endfunction()
