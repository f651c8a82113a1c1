# cmake -DIN=<text file> -DNAME=<constant> -DOUT=<header> -P Embed.cmake
# A header with the text as a constant, in pieces no compiler finds too long.
file(READ ${IN} text)
string(LENGTH "${text}" length)
set(pieces "")
set(at 0)
while(at LESS length)
    string(SUBSTRING "${text}" ${at} 8000 piece)
    string(APPEND pieces "R\"PAGE(${piece})PAGE\"\n")
    math(EXPR at "${at} + 8000")
endwhile()
file(WRITE ${OUT} "#pragma once
namespace palpate {
inline constexpr char ${NAME}[] =
${pieces};
} // namespace palpate
")
