# cmake --install: the program, the library, its headers and what find_package(ordo) needs.
include(CMakePackageConfigHelpers)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/ordo)
install(TARGETS ordo RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS ordo_core EXPORT ordo-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY src/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ordo FILES_MATCHING PATTERN "*.hpp"
  PATTERN app EXCLUDE PATTERN verification EXCLUDE)
install(PROGRAMS python/ordo_figures.py python/ordo_gallery.py DESTINATION ${CMAKE_INSTALL_DATADIR}/ordo)
install(EXPORT ordo-targets NAMESPACE ordo:: DESTINATION ${package})
configure_package_config_file(cmake/ordo-config.cmake.in ${PROJECT_BINARY_DIR}/ordo-config.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/ordo-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ordo-config.cmake ${PROJECT_BINARY_DIR}/ordo-config-version.cmake DESTINATION ${package})
