# cmake --install: the program, the libraries, their headers, and what find_package(squint) reads.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(squint_package ${CMAKE_INSTALL_LIBDIR}/cmake/squint)
install(TARGETS squint RUNTIME)
foreach(room fixedpoint core scene pipeline truth studies)
  set_target_properties(squint_${room} PROPERTIES EXPORT_NAME ${room})
  install(DIRECTORY ${room} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/squint FILES_MATCHING PATTERN "*.h")
endforeach()
install(TARGETS squint_fixedpoint squint_core squint_scene squint_pipeline squint_truth squint_studies squint_flags squint_highway EXPORT squint ARCHIVE LIBRARY)
install(EXPORT squint NAMESPACE squint:: FILE squint-targets.cmake DESTINATION ${squint_package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/squint-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/squint-config.cmake cmake/openimageio.cmake ${PROJECT_BINARY_DIR}/squint-config-version.cmake
        DESTINATION ${squint_package})
