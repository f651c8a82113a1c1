# Compile options every target shares, and the function that declares a library of the engine.

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1 -DNDEBUG") # lines in traces; compiles faster than -g
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
# Assertions name files from the root, wherever that lies: the same object from every checkout, so that ccache finds it.
add_compile_options(-fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=)

add_library(palpate_options INTERFACE)
set_target_properties(palpate_options PROPERTIES EXPORT_NAME options)
target_compile_features(palpate_options INTERFACE cxx_std_20)
# Results must not depend on how a compiler fuses multiplications and additions.
target_compile_options(palpate_options INTERFACE -ffp-contract=off)
target_compile_definitions(palpate_options INTERFACE GLM_FORCE_XYZW_ONLY GLM_FORCE_EXPLICIT_CTOR)

# Left out: fields that designated initialisers leave to their defaults, and a warning that g++ 12
# gives wrongly for std::optional.
add_library(palpate_warnings INTERFACE)
target_compile_options(palpate_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow
                       -Wnon-virtual-dtor -Wno-missing-field-initializers
                       $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
                       # sources that are compiled together see each other's unnamed namespaces
                       $<$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>:-Wno-shadow;-Wno-subobject-linkage$<$<CXX_COMPILER_ID:GNU>:;-Wshadow=local>>
                       $<$<BOOL:${PALPATE_WERROR}>:-Werror>)
if(PALPATE_SANITIZE)
    add_compile_options(-fsanitize=${PALPATE_SANITIZE} -fno-omit-frame-pointer)
    add_link_options(-fsanitize=${PALPATE_SANITIZE})
endif()

if(PALPATE_TIDY)
    find_program(CLANG_TIDY clang-tidy REQUIRED)
    set(CMAKE_CXX_CLANG_TIDY ${CLANG_TIDY} --quiet)
endif()

# palpate_compile_fast(<target>)
# For what says what is to be done and leaves the work to libraries: -O1 compiles in two thirds of the time of -O2.
function(palpate_compile_fast target)
    target_compile_options(${target} PRIVATE $<$<NOT:$<CONFIG:Debug>>:-O1>)
endfunction()

# palpate_library(<name> ABOUT <words> SOURCES ... [DEPENDS ...] [PRIVATE_DEPENDS ...])
# Declares the static library palpate_<name>, known to users as palpate::<name>. ABOUT says what is in it, for the table
# of libraries in docs/api.md (scripts/libraries).
# DEPENDS are seen through its headers; PRIVATE_DEPENDS by its sources only.
function(palpate_library name)
    cmake_parse_arguments(PARSE_ARGV 1 ARG "" "ABOUT" "SOURCES;DEPENDS;PRIVATE_DEPENDS")
    set(target palpate_${name})
    add_library(${target} STATIC ${ARG_SOURCES})
    add_library(palpate::${name} ALIAS ${target})
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
    target_include_directories(${target} PUBLIC
        $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
        $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/palpate>)
    target_link_libraries(${target} PUBLIC palpate_options ${ARG_DEPENDS}
                          PRIVATE $<BUILD_INTERFACE:palpate_warnings> ${ARG_PRIVATE_DEPENDS})
    set_property(GLOBAL APPEND PROPERTY PALPATE_LIBRARIES ${target})
    palpate_tell_of_library(${name} "${ARG_ABOUT}" ${ARG_DEPENDS} ${ARG_PRIVATE_DEPENDS})
endfunction()

# palpate_tell_of_library(<name> <words> <linked target>...)
# A line of the table of libraries; for those that are not installed and declare themselves.
function(palpate_tell_of_library name about)
    list(JOIN ARGN " " links)
    set_property(GLOBAL APPEND_STRING PROPERTY PALPATE_LIBRARY_TABLE "${name}|${about}|${links}\n")
endfunction()

# palpate_write_library_table(): <build>/libraries.txt, a line each: name|what is in it|what it links.
function(palpate_write_library_table)
    get_property(table GLOBAL PROPERTY PALPATE_LIBRARY_TABLE)
    file(WRITE ${PROJECT_BINARY_DIR}/libraries.txt "${table}")
endfunction()

# palpate_embed_text(<folder> <file>:<constant> <extension>)
# Makes <folder>/<file>.h, which holds the text of <file>.<extension> in this folder as a constant.
set(PALPATE_EMBED_TEXT ${CMAKE_CURRENT_LIST_DIR}/EmbedText.cmake)
function(palpate_embed_text folder part extension)
    string(REPLACE ":" ";" part ${part})
    list(GET part 0 file)
    list(GET part 1 constant)
    file(MAKE_DIRECTORY ${folder})
    set(text ${CMAKE_CURRENT_SOURCE_DIR}/${file}.${extension})
    add_custom_command(OUTPUT ${folder}/${file}.h
        COMMAND ${CMAKE_COMMAND} -DIN=${text} -DNAME=${constant} -DOUT=${folder}/${file}.h
                -P ${PALPATE_EMBED_TEXT}
        DEPENDS ${text} ${PALPATE_EMBED_TEXT})
endfunction()
include(GNUInstallDirs)
