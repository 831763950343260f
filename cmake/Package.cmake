# The Debian package: cpack -G DEB. deploy/package/build calls it with all that makes the result reproducible.
find_program(HELP2MAN help2man REQUIRED)
find_program(GZIP gzip REQUIRED)

set(epoch $ENV{SOURCE_DATE_EPOCH})
if(NOT epoch)
  message(FATAL_ERROR "SOURCE_DATE_EPOCH is not set; build the package by deploy/package/build")
endif()
set(folder ${PROJECT_BINARY_DIR}/package)

# Manual pages of all commands, by their --help. Some commands are programs of their own, which must be there.
get_property(helpers GLOBAL PROPERTY kilotwin_helpers)
add_custom_command(
  OUTPUT ${folder}/manual.stamp
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${folder}/man
  COMMAND ${PROJECT_SOURCE_DIR}/deploy/package/manual $<TARGET_FILE:kilotwin> ${folder}/man
  COMMAND sh -c "${GZIP} -n9 ${folder}/man/*.1"
  COMMAND ${CMAKE_COMMAND} -E touch ${folder}/manual.stamp
  DEPENDS kilotwin ${helpers} ${PROJECT_SOURCE_DIR}/deploy/package/manual
  VERBATIM)
add_custom_target(manual ALL DEPENDS ${folder}/manual.stamp)
install(DIRECTORY ${folder}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)

# Files that Debian requires of every package.
execute_process(COMMAND date -u -R -d @${epoch} OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
set(maintainer "The Kilotwin authors <kilotwin@localhost.localdomain>")
file(WRITE ${folder}/changelog
  "kilotwin (${PROJECT_VERSION}) unstable; urgency=medium\n\n  * Built from the sources of this version.\n\n -- ${maintainer}  ${date}\n")
execute_process(COMMAND ${GZIP} -n9f ${folder}/changelog COMMAND_ERROR_IS_FATAL ANY)
file(READ ${PROJECT_SOURCE_DIR}/LICENSE license)
string(REGEX REPLACE "\n\n" "\n.\n" license "${license}")
string(REGEX REPLACE "\n([^\n])" "\n \\1" license " ${license}")
file(WRITE ${folder}/copyright
  "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: Kilotwin\n\n"
  "Files: *\nCopyright: 2026 the Kilotwin authors\nLicense: Expat\n\nLicense: Expat\n${license}")
install(FILES ${folder}/changelog.gz ${folder}/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/kilotwin)
install(FILES deploy/package/lintian-overrides RENAME kilotwin DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides)
# The Python package is pure, for Debian's Python.
install(DIRECTORY python/src/kilotwin DESTINATION lib/python3/dist-packages
  FILES_MATCHING PATTERN "*.py" PATTERN "py.typed" PATTERN "__pycache__" EXCLUDE)

set(CPACK_PACKAGE_NAME kilotwin)
set(CPACK_PACKAGE_CONTACT "${maintainer}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "co-simulation of Kilobot swarms over DDS")
set(CPACK_PACKAGE_DESCRIPTION
  "Kilotwin simulates swarms of Kilobots that run their unmodified C programs,\nas services on one or several machines. Simulated robots, real robots under\na camera, and a simulated or real base station share one experiment.\n.\nResults have the same bits however a run is divided.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# A run compiles the programs of robots.
set(CPACK_DEBIAN_PACKAGE_DEPENDS "gcc, libc6-dev")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "g++, python3, python3-numpy, gnuplot-nox, ffmpeg, fonts-dejavu-core")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "gcc-avr, avr-libc, binutils-avr, gdb, python3-pandas")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
file(WRITE ${folder}/times.cmake
  "execute_process(COMMAND find \${CPACK_TEMPORARY_INSTALL_DIRECTORY} -exec touch -h -d @${epoch} {} + COMMAND_ERROR_IS_FATAL ANY)\n")
set(CPACK_PRE_BUILD_SCRIPTS ${folder}/times.cmake)
include(CPack)
