# cmake --install: the program, the library, its headers and what find_package(ordo) needs; cases and documentation.
include(CMakePackageConfigHelpers)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/ordo)
if(ORDO_PACKAGE)  # there may be several, see package.cmake; the program looks for ../share/ordo
  install(TARGETS ordo RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR} COMPONENT program)
else()
  install(TARGETS ordo RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
endif()
if(ORDO_RANKS)
  install(TARGETS ordo_ranks LIBRARY DESTINATION lib/ordo)
endif()
install(TARGETS ordo_core EXPORT ordo-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY src/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ordo FILES_MATCHING PATTERN "*.hpp"
  PATTERN app EXCLUDE PATTERN verification EXCLUDE)
install(PROGRAMS python/ordo_figures.py python/ordo_gallery.py DESTINATION ${CMAKE_INSTALL_DATADIR}/ordo)
install(EXPORT ordo-targets NAMESPACE ordo:: DESTINATION ${package})
configure_package_config_file(cmake/ordo-config.cmake.in ${PROJECT_BINARY_DIR}/ordo-config.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/ordo-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ordo-config.cmake ${PROJECT_BINARY_DIR}/ordo-config-version.cmake DESTINATION ${package})

# Cases without their figures, documentation without those of the gallery.
install(DIRECTORY cases DESTINATION ${CMAKE_INSTALL_DATADIR}/ordo
  FILES_MATCHING REGEX "\\.(toml|md|py|csv|msh|stl)$" PATTERN __pycache__ EXCLUDE)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} FILES_MATCHING PATTERN "*.md" PATTERN gallery EXCLUDE PATTERN site EXCLUDE)
install(FILES README.md CITATION.cff DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES packaging/ordo.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME ordo)
configure_file(packaging/ordo.1.in ordo.1 @ONLY)
execute_process(COMMAND gzip -9nkf ordo.1 WORKING_DIRECTORY ${PROJECT_BINARY_DIR} COMMAND_ERROR_IS_FATAL ANY)
install(FILES ${PROJECT_BINARY_DIR}/ordo.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
