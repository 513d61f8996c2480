# cmake --install, and cpack -G DEB: two packages.  `squint`: the program, its modules, its scenes, manual and completions.
# `squint-dev`: the libraries, their headers, and what find_package(squint) reads.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(squint_package ${CMAKE_INSTALL_LIBDIR}/cmake/squint)
set(squint_modules ${CMAKE_INSTALL_LIBDIR}/squint)
set(squint_rooms fixedpoint core scene pipeline truth studies)

# The program
file(RELATIVE_PATH to_modules /${CMAKE_INSTALL_BINDIR} /${squint_modules})
set_target_properties(squint PROPERTIES INSTALL_RPATH $ORIGIN/${to_modules})
install(TARGETS squint RUNTIME COMPONENT squint)
install(TARGETS squint_pictures LIBRARY DESTINATION ${squint_modules} COMPONENT squint)
file(RELATIVE_PATH to_modules /${CMAKE_INSTALL_LIBEXECDIR}/squint /${squint_modules})
# or beside it, in the Python package
set_target_properties(squint-read PROPERTIES INSTALL_RPATH "$ORIGIN/${to_modules};$ORIGIN")
install(TARGETS squint-read RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/squint COMPONENT squint)
install(DIRECTORY configs DESTINATION ${CMAKE_INSTALL_DATADIR}/squint COMPONENT squint)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs COMPONENT squint)
install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT squint)
set(manual ${PROJECT_BINARY_DIR}/manual)
add_custom_command(OUTPUT ${manual}/man/man1/squint.1
                   COMMAND ${CMAKE_COMMAND} -E rm -rf ${manual}
                   COMMAND ${CMAKE_COMMAND} -DSQUINT=$<TARGET_FILE:squint> -DFOLDER=${manual} -P ${PROJECT_SOURCE_DIR}/cmake/manual.cmake
                   DEPENDS squint cmake/manual.cmake VERBATIM)
add_custom_target(squint_manual ALL DEPENDS ${manual}/man/man1/squint.1)
install(DIRECTORY ${manual}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT squint)
install(FILES ${manual}/bash/squint DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT squint)
install(FILES ${manual}/zsh/_squint DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT squint)
install(FILES ${manual}/fish/squint.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT squint)

# The libraries
foreach(room ${squint_rooms})
  set_target_properties(squint_${room} PROPERTIES EXPORT_NAME ${room})
  list(APPEND squint_libraries squint_${room})
endforeach()
install(TARGETS ${squint_libraries} squint_flags squint_highway EXPORT squint ARCHIVE COMPONENT dev LIBRARY COMPONENT dev)
list(JOIN squint_rooms "," rooms)
install(CODE "execute_process(COMMAND \"${CMAKE_COMMAND}\" -DSOURCE=${PROJECT_SOURCE_DIR} -DROOMS=${rooms}
  \"-DFOLDER=\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}/squint\"
  -P \"${PROJECT_SOURCE_DIR}/cmake/headers.cmake\" COMMAND_ERROR_IS_FATAL ANY)" COMPONENT dev)
install(EXPORT squint NAMESPACE squint:: FILE squint-targets.cmake DESTINATION ${squint_package} COMPONENT dev)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/squint-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/squint-config.cmake ${PROJECT_BINARY_DIR}/squint-config-version.cmake
        DESTINATION ${squint_package} COMPONENT dev)

# The packages: what the programs need is found by dpkg-shlibdeps.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME squint)
set(CPACK_PACKAGE_CONTACT "squint maintainers <maintainers@users.noreply.squint.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL squint dev)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_SQUINT_PACKAGE_NAME squint)
set(CPACK_DEBIAN_SQUINT_PACKAGE_SHLIBDEPS ON)
set(CPACK_COMPONENT_SQUINT_DESCRIPTION "${PROJECT_DESCRIPTION}")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME squint-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
    "squint (= ${PROJECT_VERSION}), libimath-dev, libfmt-dev, libtbb-dev, nlohmann-json3-dev, libhwy-dev, libteem-dev, zlib1g-dev")
set(CPACK_COMPONENT_DEV_DESCRIPTION "${PROJECT_DESCRIPTION}: libraries and headers")
include(CPack)
