# cmake -DSOURCE=<checkout> -DOUT=<file.cpp> -P Commit.cmake
# Writes which commit is being built; touches the file only when that has changed.
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=12 --exclude=*
                OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT commit)
    set(commit unknown)
endif()
set(text "#include \"engine/version/version.h\"
namespace palpate {
const char* built_from() {
    return \"${commit}\";
}
} // namespace palpate
")
set(old "")
if(EXISTS ${OUT})
    file(READ ${OUT} old)
endif()
if(NOT old STREQUAL text)
    file(WRITE ${OUT} "${text}")
endif()
