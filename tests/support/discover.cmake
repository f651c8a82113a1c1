# Run each time a test program is built: lists its cases and writes OUT, which adds them to CTest. With EACH=suite the
# cases of a suite are one test and share a process: starting one (Vulkan, its validation layers, ITK) costs more
# than most cases. With EACH=case each is a test.
#   -DPROGRAM=<file> -DPREFIX=<before the names> -DEACH=suite|case -DLABEL=<label> -DTIMEOUT_S=<of a test>
#   -DCASES=<regex of suite.case> -DENVIRONMENT=<variable=value;...> -DOUT=<file>
cmake_minimum_required(VERSION 3.25)
file(REMOVE ${OUT})
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listed RESULT_VARIABLE code TIMEOUT 60)
if(NOT code EQUAL 0)
    message(FATAL_ERROR "${PROGRAM} --gtest_list_tests: expected exit code 0, found ${code}")
endif()
string(REGEX REPLACE "[ \t]*#[^\n]*" "" listed "${listed}") # parameters
string(REGEX REPLACE "[;[]|]" "_" listed "${listed}")
string(REPLACE "\n" ";" lines "${listed}")

# A test that has only skipped cases is skipped; one failure makes it fail.
set(skipped "\\[  PASSED  \\] 0 tests\\.\n\\[  SKIPPED \\] [0-9]+ tests?, listed below:\n(\\[  SKIPPED \\] [^\n]*\n)+$")
set(text "")
macro(add name filter)
    string(APPEND text "add_test([=[${PREFIX}${name}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${filter}]=])\n"
        "set_tests_properties([=[${PREFIX}${name}]=] PROPERTIES LABELS ${LABEL} TIMEOUT ${TIMEOUT_S} ENVIRONMENT [=[${ENVIRONMENT}]=]\n"
        "    SKIP_REGULAR_EXPRESSION [=[${skipped}]=])\n")
endmacro()
set(suite "")
set(added "")
foreach(line IN LISTS lines)
    if(line MATCHES "^([^ ]+)\\.$")
        set(suite ${CMAKE_MATCH_1})
    elseif(line MATCHES "^  ([^ ]+)$")
        set(case ${suite}.${CMAKE_MATCH_1})
        if(case MATCHES "(^|[./])DISABLED_" OR NOT case MATCHES "${CASES}")
            continue()
        elseif(EACH STREQUAL "case")
            add(${case} ${case})
        elseif(NOT suite STREQUAL added)
            add(${suite} ${suite}.*)
        endif()
        set(added ${suite})
    endif()
endforeach()
if(text STREQUAL "")
    message(FATAL_ERROR "${PROGRAM}: expected cases that match '${CASES}', found none")
endif()
file(WRITE ${OUT} "${text}")
