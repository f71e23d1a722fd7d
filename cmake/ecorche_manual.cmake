# SPDX-License-Identifier: Apache-2.0
# Man pages, completion of shells and systemd's units, installed beside the command. The first two are made from its help by scripts/manual,
# whenever it was linked anew: they cannot say anything else.
file(GLOB _sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/scripts/documentation/*.py)
set(_manual ${PROJECT_BINARY_DIR}/manual)
find_program(ECORCHE_MANUAL_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH)
# A program with sanitizers tells the same, slowly.
if(ECORCHE_MANUAL_PYTHON AND NOT ECORCHE_SANITIZE)
  add_custom_command(OUTPUT ${_manual}/made
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${_manual}
    COMMAND ${CMAKE_COMMAND} -E env ECORCHE_BIN=$<TARGET_FILE:ecorche> PYTHONDONTWRITEBYTECODE=1
      ${ECORCHE_MANUAL_PYTHON} ${PROJECT_SOURCE_DIR}/scripts/manual ${_manual}
    COMMAND ${CMAKE_COMMAND} -E touch ${_manual}/made
    DEPENDS ecorche ${PROJECT_SOURCE_DIR}/scripts/manual ${_sources} COMMENT "Man pages and completion" VERBATIM)
  add_custom_target(ecorche_manual ALL DEPENDS ${_manual}/made)
  install(DIRECTORY ${_manual}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT command)
  install(FILES ${_manual}/bash/ecorche DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT command)
  # Debian's folders: those that its zsh and fish keep for packages.
  install(FILES ${_manual}/zsh/_ecorche DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT command)
  install(FILES ${_manual}/fish/ecorche.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT command)
endif()
# Without a path in them: systemd looks in /usr/local/bin and /usr/bin.
install(FILES deploy/systemd/ecorche.service deploy/systemd/ecorche.socket DESTINATION lib/systemd/system COMPONENT command)
