# cmake --install: the components runtime, bench, development, python, data and documentation; all of them
# where none is named. find_package(palpate) needs development, and runtime to read foreign files.
include(CMakePackageConfigHelpers)

get_property(libraries GLOBAL PROPERTY PALPATE_LIBRARIES)
# palpate::palpate is all of them that are installed.
add_library(palpate_all INTERFACE)
add_library(palpate::palpate ALIAS palpate_all)
set_target_properties(palpate_all PROPERTIES EXPORT_NAME palpate)
target_link_libraries(palpate_all INTERFACE ${libraries})
install(TARGETS palpate_options palpate_all ${libraries} EXPORT palpate-targets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
include(PublicHeaders)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
install(EXPORT palpate-targets NAMESPACE palpate:: DESTINATION ${package_dir} COMPONENT development)
configure_package_config_file(cmake/palpate-config.cmake.in
    ${CMAKE_CURRENT_BINARY_DIR}/palpate-config.cmake INSTALL_DESTINATION ${package_dir}
    PATH_VARS CMAKE_INSTALL_BINDIR)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/palpate-config-version.cmake
    COMPATIBILITY SameMinorVersion)
install(FILES cmake/installed_bin.cpp.in ${CMAKE_CURRENT_BINARY_DIR}/palpate-config.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/palpate-config-version.cmake
        DESTINATION ${package_dir} COMPONENT development)

# In the prefix, for a person to copy: where udev reads it only root may write.
install(FILES haptics/device/udev/70-palpate.rules
        DESTINATION ${CMAKE_INSTALL_DATADIR}/palpate/udev COMPONENT data)

foreach(program palpate:runtime palpate-bench:bench)
    string(REPLACE ":" ";" program ${program})
    list(GET program 0 name)
    list(GET program 1 component)
    if(TARGET ${name})
        install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${component})
    endif()
endforeach()

if(TARGET palpate_python)
    set(PALPATE_PYTHON_DIR lib/python3/dist-packages CACHE STRING
        "Where Python looks for packages, below the prefix")
    install(TARGETS palpate_python LIBRARY DESTINATION ${PALPATE_PYTHON_DIR}/palpate COMPONENT python)
    install(DIRECTORY python/palpate DESTINATION ${PALPATE_PYTHON_DIR} COMPONENT python
            FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed" PATTERN "__pycache__" EXCLUDE)
endif()

install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation)
# The fonts in the program have licences of their own (OFL 1.1; the drawings of icons CC BY).
foreach(font LETTERS:fonts-noto-core ICONS:fonts-materialdesignicons-webfont)
    string(REPLACE ":" ";" font ${font})
    list(GET font 0 file)
    list(GET font 1 package)
    set(notice /usr/share/doc/${package}/copyright)
    if(PALPATE_${file} AND EXISTS ${notice})
        set(name ${package}.copyright)
        install(FILES ${notice} RENAME ${name} DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation)
        install(FILES ${notice} RENAME ${name} DESTINATION share/palpate COMPONENT bundle EXCLUDE_FROM_ALL)
        install(FILES ${notice} RENAME ${name} DESTINATION palpate COMPONENT wheel EXCLUDE_FROM_ALL)
    endif()
endforeach()
install(DIRECTORY docs/guide docs/reference docs/pictures DESTINATION ${CMAKE_INSTALL_DOCDIR}
        COMPONENT documentation)
if(TARGET palpate)
    # Manual pages and shell completion, from what the program says of itself.
    find_package(Python3 QUIET COMPONENTS Interpreter)
    if(Python3_Interpreter_FOUND)
        set(manual ${PROJECT_BINARY_DIR}/manual)
        add_custom_command(OUTPUT ${manual}/palpate.1 ${manual}/completion/palpate
            COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/scripts/manual $<TARGET_FILE:palpate> ${manual}
            DEPENDS scripts/manual palpate $<TARGET_NAME_IF_EXISTS:palpate-bench>
            COMMENT "Manual pages")
        # And the libraries that the binaries link, with their Debian packages.
        set(binaries $<TARGET_FILE:palpate>)
        foreach(other palpate-bench palpate_python)
            if(TARGET ${other})
                list(APPEND binaries $<TARGET_FILE:${other}>)
            endif()
        endforeach()
        find_program(PALPATE_OBJDUMP objdump)
        if(PALPATE_OBJDUMP)
            add_custom_command(OUTPUT ${manual}/linked.txt
                COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/scripts/linked ${binaries} > ${manual}/linked.txt
                DEPENDS scripts/linked palpate $<TARGET_NAME_IF_EXISTS:palpate-bench>
                        $<TARGET_NAME_IF_EXISTS:palpate_python> ${manual}/palpate.1
                COMMENT "List of linked libraries" VERBATIM)
            set(linked ${manual}/linked.txt)
            install(FILES ${linked} DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation)
        endif()
        add_custom_target(palpate_manual ALL DEPENDS ${manual}/palpate.1 ${linked})
        install(DIRECTORY ${manual}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT documentation
                FILES_MATCHING PATTERN "*.1" PATTERN "completion" EXCLUDE)
        install(FILES ${manual}/completion/palpate
                DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT documentation)
    else()
        message(STATUS "manual pages: left out, because Python was not found")
    endif()
    install(FILES apps/view/palpate.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications
            COMPONENT data)
    install(FILES apps/view/palpate.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages
            COMPONENT data)
endif()
