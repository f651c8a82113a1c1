# `ninja package`: a relocatable archive of the program, for machines with other Linux distributions
# (glibc 2.36 or later, x86-64), where it is unpacked anywhere and run.
#
#   bin/palpate, bin/golden_test   found libraries in ../lib, of the machine's own ones only those below
#   lib                            every library they need, and the Vulkan loader, which finds the
#                                  machine's drivers
#   lib/fallback                   libstdc++ and libgcc_s
#   share/palpate                  golden pictures, gpu-report
#
# From the machine come glibc, which fits its kernel and its dynamic linker, and libstdc++ and
# libgcc_s, because its graphics drivers are loaded into the same process and need theirs: an older
# one bundled in front would keep a newer driver from loading. A distribution with glibc 2.36 (August
# 2022) is newer than g++ 12 (May 2022), whose libstdc++ this is built with; where it has none at all,
# lib/fallback is put on LD_LIBRARY_PATH by hand (gpu-report does so).
#
# The libraries keep no path of their own, so theirs are found through the program's DT_RPATH, which
# unlike DT_RUNPATH holds for what libraries load too.
set(programs palpate)
if(TARGET golden_test)
    list(APPEND programs golden_test)
endif()
set_target_properties(${programs} PROPERTIES INSTALL_RPATH "$ORIGIN/../lib")
foreach(program ${programs})
    target_link_options(${program} PRIVATE -Wl,--disable-new-dtags)
endforeach()

install(TARGETS ${programs} RUNTIME_DEPENDENCY_SET palpate_bundle
        RUNTIME DESTINATION bin COMPONENT bundle EXCLUDE_FROM_ALL)
install(RUNTIME_DEPENDENCY_SET palpate_bundle
        PRE_EXCLUDE_REGEXES "^ld-linux" "^lib(c|m|dl|rt|pthread|resolv|mvec)\\.so" "^libstdc\\+\\+"
                            "^libgcc_s"
        LIBRARY DESTINATION lib COMPONENT bundle EXCLUDE_FROM_ALL)

find_library(PALPATE_VULKAN_LOADER NAMES libvulkan.so.1 REQUIRED) # opened by name, not linked
file(REAL_PATH ${PALPATE_VULKAN_LOADER} loader)
install(FILES ${loader} DESTINATION lib RENAME libvulkan.so.1 COMPONENT bundle EXCLUDE_FROM_ALL)
foreach(name libstdc++.so.6 libgcc_s.so.1)
    execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=${name}
                    OUTPUT_VARIABLE path OUTPUT_STRIP_TRAILING_WHITESPACE)
    file(REAL_PATH ${path} path)
    install(FILES ${path} DESTINATION lib/fallback RENAME ${name} COMPONENT bundle EXCLUDE_FROM_ALL)
endforeach()
install(DIRECTORY golden DESTINATION share/palpate COMPONENT bundle EXCLUDE_FROM_ALL)
install(FILES LICENSE DESTINATION share/palpate COMPONENT bundle EXCLUDE_FROM_ALL)
install(PROGRAMS scripts/gpu-report DESTINATION bin COMPONENT bundle EXCLUDE_FROM_ALL)
install(CODE "set(PALPATE_PREFIX \"\${CMAKE_INSTALL_PREFIX}\")
              include(\"${PROJECT_SOURCE_DIR}/cmake/BundleNotices.cmake\")"
        COMPONENT bundle EXCLUDE_FROM_ALL)

# The same libraries, program and Python module as a wheel lays them out (scripts/wheel makes the file):
# palpate/_core.so, palpate/lib, palpate/bin/palpate.
if(TARGET palpate_python)
    set_target_properties(palpate_python PROPERTIES INSTALL_RPATH "$ORIGIN/lib")
    target_link_options(palpate_python PRIVATE -Wl,--disable-new-dtags)
    install(TARGETS palpate RUNTIME_DEPENDENCY_SET palpate_wheel
            RUNTIME DESTINATION palpate/bin COMPONENT wheel EXCLUDE_FROM_ALL)
    install(TARGETS palpate_python RUNTIME_DEPENDENCY_SET palpate_wheel
            LIBRARY DESTINATION palpate COMPONENT wheel EXCLUDE_FROM_ALL)
    install(RUNTIME_DEPENDENCY_SET palpate_wheel
            PRE_EXCLUDE_REGEXES "^ld-linux" "^lib(c|m|dl|rt|pthread|resolv|mvec)\\.so" "^libstdc\\+\\+"
                                "^libgcc_s" "^libpython"
            LIBRARY DESTINATION palpate/lib COMPONENT wheel EXCLUDE_FROM_ALL)
    install(FILES ${loader} DESTINATION palpate/lib RENAME libvulkan.so.1 COMPONENT wheel EXCLUDE_FROM_ALL)
    install(DIRECTORY python/palpate DESTINATION . COMPONENT wheel EXCLUDE_FROM_ALL
            FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed" PATTERN "__pycache__" EXCLUDE)
endif()

set(CPACK_GENERATOR TGZ)
set(CPACK_PACKAGE_NAME palpate)
set(CPACK_PACKAGE_VENDOR Palpate)
set(CPACK_PACKAGE_CONTACT "The authors of Palpate <palpate@localhost>")
set(CPACK_PACKAGE_FILE_NAME palpate-${PROJECT_VERSION}-linux-${CMAKE_SYSTEM_PROCESSOR})
set(CPACK_COMPONENTS_ALL bundle)
set(CPACK_COMPONENT_INCLUDE_TOPLEVEL_DIRECTORY ON)
set(CPACK_ARCHIVE_COMPONENT_INSTALL ON)
set(CPACK_ARCHIVE_BUNDLE_FILE_NAME ${CPACK_PACKAGE_FILE_NAME})
set(CPACK_STRIP_FILES ON)
set(CPACK_THREADS 0)
set(CPACK_VERBATIM_VARIABLES ON)
# `cpack -G DEB`: packages for the Debian that builds them, in place of the archive; cmake/DebianPackages.cmake.
set(CPACK_PALPATE_COMPONENTS runtime data documentation development)
if(TARGET palpate-bench)
    list(APPEND CPACK_PALPATE_COMPONENTS bench)
endif()
if(TARGET palpate_python)
    list(APPEND CPACK_PALPATE_COMPONENTS python)
    set(CPACK_PALPATE_PYTHON_VERSION ${PALPATE_PYTHON_VERSION})
endif()
set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_SOURCE_DIR}/cmake/DebianPackages.cmake)
include(CPack)
