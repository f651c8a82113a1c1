# cmake --install: headers, libraries, the program, and find_package(palpate).
include(CMakePackageConfigHelpers)

get_property(libraries GLOBAL PROPERTY PALPATE_LIBRARIES)
install(TARGETS palpate_options ${libraries} EXPORT palpate-targets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
if(TARGET palpate)
    install(TARGETS palpate RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
# In the prefix, for a person to copy: where udev reads it only root may write.
install(FILES haptics/device/udev/70-palpate.rules
        DESTINATION ${CMAKE_INSTALL_DATADIR}/palpate/udev)
install(DIRECTORY engine haptics shaders DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/palpate
        FILES_MATCHING PATTERN "*.h" PATTERN "decode" EXCLUDE)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
install(EXPORT palpate-targets NAMESPACE palpate:: DESTINATION ${package_dir})
configure_package_config_file(cmake/palpate-config.cmake.in
    ${CMAKE_CURRENT_BINARY_DIR}/palpate-config.cmake INSTALL_DESTINATION ${package_dir}
    PATH_VARS CMAKE_INSTALL_BINDIR)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/palpate-config-version.cmake
    COMPATIBILITY SameMinorVersion)
install(FILES cmake/installed_bin.cpp.in ${CMAKE_CURRENT_BINARY_DIR}/palpate-config.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/palpate-config-version.cmake DESTINATION ${package_dir})
