# SPDX-License-Identifier: Apache-2.0
# What other projects link, by add_subdirectory or find_package(ecorche COMPONENTS ...):
#   ecorche::c           libecorche.so: poses in process, by a C ABI
#   ecorche::c_client    libecorche_client.so: shows what a server poses, likewise
#   ecorche::runtime     poses prepared models: bodies, volumes, probes, quality
#   ecorche::client      speaks with a server
#   ecorche::preprocess  reads cases and prepares models (with ECORCHE_TOOLS)
if(NOT ECORCHE_RUNTIME)
  # The client library and its headers, for programs of a system that ecorche does not run on.
  if(ECORCHE_INSTALL)
    install(TARGETS ecorche_c_client)
    install(FILES clients/c/include/ecorche/ecorche.h clients/c/include/ecorche/ecorche_client.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ecorche)
  endif()
  return()
endif()

set(_components runtime client)
add_library(ecorche_api_runtime INTERFACE)
target_link_libraries(ecorche_api_runtime INTERFACE ecorche_runtime ecorche_kinematics ecorche_model_file)
add_library(ecorche_api_client INTERFACE)
target_link_libraries(ecorche_api_client INTERFACE ecorche_client ecorche_proto)
if(ECORCHE_TOOLS)
  list(APPEND _components preprocess)
  add_library(ecorche_api_preprocess INTERFACE)
  target_link_libraries(ecorche_api_preprocess INTERFACE ecorche_preprocess ecorche_io_case ecorche_model_file)
endif()
foreach(_component ${_components})
  add_library(ecorche::${_component} ALIAS ecorche_api_${_component})
  set_property(TARGET ecorche_api_${_component} PROPERTY EXPORT_NAME ${_component})
endforeach()

if(NOT ECORCHE_INSTALL)
  return()
endif()

# Our libraries that TARGET links, however far, added to the list OUT.
function(ecorche_linked out target)
  get_target_property(libraries ${target} INTERFACE_LINK_LIBRARIES)
  set(all ${${out}} ${target})
  foreach(library ${libraries})
    string(REGEX REPLACE "^\\$<LINK_ONLY:(.+)>$" "\\1" library "${library}")
    if(library MATCHES "^ecorche_" AND TARGET ${library} AND NOT library IN_LIST all)
      ecorche_linked(all ${library})
    endif()
  endforeach()
  set(${out} ${all} PARENT_SCOPE)
endfunction()

foreach(_component ${_components})
  set(_installed)
  ecorche_linked(_installed ecorche_api_${_component})
  foreach(_target ${_installed})
    # Inner libraries stand as ecorche::detail_...: they are found, and not to be named.
    get_target_property(_name ${_target} EXPORT_NAME)
    if(NOT _name)
      string(REGEX REPLACE "^ecorche_" "detail_" _name ${_target})
      set_property(TARGET ${_target} PROPERTY EXPORT_NAME ${_name})
    endif()
  endforeach()
  list(APPEND _all ${_installed})
endforeach()
list(REMOVE_DUPLICATES _all)
# Components are packages (ecorche_packages.cmake).
install(TARGETS ecorche_c ecorche_c_client ${_all} EXPORT ecorche
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development
  INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES clients/c/include/ecorche/ecorche.h clients/c/include/ecorche/ecorche_client.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ecorche
  COMPONENT development)
# From the pkgconfig folder up to where all is installed.
string(REGEX REPLACE "[^/]+" ".." _up ${CMAKE_INSTALL_LIBDIR})
foreach(_name ecorche ecorche_client)
  configure_file(cmake/ecorche.pc.in ${PROJECT_BINARY_DIR}/${_name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${_name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endforeach()
foreach(_headers core/include proto/include runtime/include clients/cpp/include)
  install(DIRECTORY ${_headers}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development FILES_MATCHING PATTERN "*.hpp")
endforeach()
install(DIRECTORY ${PROJECT_BINARY_DIR}/include/ ${PROJECT_BINARY_DIR}/proto/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
  FILES_MATCHING PATTERN "*.hpp" PATTERN "*.pb.h" PATTERN CMakeFiles EXCLUDE PATTERN python EXCLUDE)
if(ECORCHE_TOOLS)
  foreach(_headers io/include preprocess/include)
    install(DIRECTORY ${_headers}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development FILES_MATCHING PATTERN "*.hpp")
  endforeach()
  install(TARGETS ecorche DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT command)
  # `ecorche cohort` looks for it from its own place up.
  install(DIRECTORY workflow DESTINATION ${CMAKE_INSTALL_DATADIR}/ecorche COMPONENT command USE_SOURCE_PERMISSIONS PATTERN __pycache__ EXCLUDE)
  include(ecorche_manual)
endif()

include(CMakePackageConfigHelpers)
set(_package ${CMAKE_INSTALL_LIBDIR}/cmake/ecorche)
install(EXPORT ecorche NAMESPACE ecorche:: FILE ecorche-targets.cmake DESTINATION ${_package} COMPONENT development)
configure_package_config_file(cmake/ecorche-config.cmake.in ${PROJECT_BINARY_DIR}/ecorche-config.cmake INSTALL_DESTINATION ${_package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/ecorche-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ecorche-config.cmake ${PROJECT_BINARY_DIR}/ecorche-config-version.cmake DESTINATION ${_package}
  COMPONENT development)
include(ecorche_packages)
