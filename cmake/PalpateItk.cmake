# ITK's headers and libraries, named one by one: its own package file asks for HDF5, VTK and C.
# Distributions put the version into the names (ITK-5.2 in Debian 12, ITK-5.4 in Debian 13).

# palpate_find_itk(<result> <library>...)
# Sets <result> to the files of the libraries (ITKCommon, itksys, ...) and the cache entry ITK_INCLUDE to the
# folder of the newest headers. Where something is missing, <result> is "<name>-NOTFOUND".
function(palpate_find_itk result)
    if(NOT ITK_INCLUDE)
        foreach(prefix ${CMAKE_PREFIX_PATH} ${CMAKE_SYSTEM_PREFIX_PATH})
            file(GLOB found ${prefix}/include/ITK-*)
            list(APPEND folders ${found})
        endforeach()
        list(SORT folders COMPARE NATURAL ORDER DESCENDING)
        find_path(ITK_INCLUDE itkPNGImageIO.h HINTS ${folders})
    endif()
    string(REGEX MATCH "-[0-9.]+$" version "${ITK_INCLUDE}")
    set(files ${ITK_INCLUDE})
    foreach(library ${ARGN})
        find_library(FOUND_${library} NAMES ${library}${version} ${library})
        list(APPEND files ${FOUND_${library}})
    endforeach()
    string(REGEX MATCH "[^;]*-NOTFOUND" missing "${files}")
    if(missing)
        set(files ${missing})
    else()
        list(POP_FRONT files)
    endif()
    set(${result} ${files} PARENT_SCOPE)
endfunction()

# palpate_require_itk(<result> <library>...): the same, and an error where something is missing.
function(palpate_require_itk result)
    palpate_find_itk(files ${ARGN})
    if(NOT files)
        message(FATAL_ERROR "expected ITK with ${ARGN} (Debian: libinsighttoolkit5-dev), found ${files}")
    endif()
    set(${result} ${files} PARENT_SCOPE)
endfunction()
