# SPDX-License-Identifier: Apache-2.0
# Debian packages, by CPack: one a component. scripts/package builds them.
#   command      ecorche          the program, man pages, completion, systemd's units
#   library      libecorcheN      both shared libraries, N their SOVERSION
#   development  libecorche-dev   headers, static libraries, CMake's and pkg-config's files
#   pages        ecorche-doc      the docs, as a site
#   python       python3-ecorche  the Python package
if(NOT ECORCHE_TOOLS OR NOT TARGET ecorche_manual)
  return()
endif()
get_target_property(_soversion ecorche_c SOVERSION)
set(_packages command library development pages python)
set(_name_command ecorche)
set(_name_library libecorche${_soversion})
set(_name_development libecorche-dev)
set(_name_pages ecorche-doc)
set(_name_python python3-ecorche)

# For packages alone: `cmake --install` leaves docs to read where they are, and Python to pip.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/build/docs/site/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/ecorche-doc/html
  COMPONENT pages EXCLUDE_FROM_ALL OPTIONAL PATTERN sitemap.xml.gz EXCLUDE)
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/ecorche-doc COMPONENT pages EXCLUDE_FROM_ALL
  PATTERN __pycache__ EXCLUDE)
install(DIRECTORY clients/python/src/ecorche DESTINATION lib/python3/dist-packages COMPONENT python EXCLUDE_FROM_ALL
  PATTERN __pycache__ EXCLUDE)
set(_metadata ${PROJECT_BINARY_DIR}/packages/METADATA)
file(CONFIGURE OUTPUT ${_metadata} CONTENT "Metadata-Version: 2.1\nName: ecorche\nVersion: @PROJECT_VERSION@\nLicense: Apache-2.0\nRequires-Dist: numpy\n" @ONLY)
install(FILES ${_metadata} DESTINATION lib/python3/dist-packages/ecorche-${PROJECT_VERSION}.dist-info COMPONENT python EXCLUDE_FROM_ALL)

# /usr/share/doc: licences and changelogs, which scripts/package makes.
foreach(_component ${_packages})
  install(DIRECTORY ${PROJECT_BINARY_DIR}/packages/${_component}/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${_name_${_component}}
    COMPONENT ${_component} EXCLUDE_FROM_ALL OPTIONAL)
  string(TOUPPER ${_component} _upper)
  set(CPACK_DEBIAN_${_upper}_PACKAGE_NAME ${_name_${_component}})
endforeach()

add_custom_target(ecorche_packaged DEPENDS ecorche ecorche_manual ecorche_c ecorche_c_client)
foreach(_target ${_all})
  get_target_property(_type ${_target} TYPE)
  if(_type STREQUAL "STATIC_LIBRARY")
    add_dependencies(ecorche_packaged ${_target})
  endif()
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME ecorche)
set(CPACK_PACKAGE_VENDOR "The ecorche maintainers")
set(ECORCHE_MAINTAINER "The ecorche maintainers <maintainers@ecorche.invalid>" CACHE STRING "Who packages, as NAME <MAIL>")
set(CPACK_PACKAGE_CONTACT ${ECORCHE_MAINTAINER})
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL ${_packages})
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SOURCE ecorche)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/clients/c)

set(CPACK_DEBIAN_COMMAND_PACKAGE_SECTION science)
set(CPACK_DEBIAN_COMMAND_PACKAGE_SHLIBDEPS ON)
# Steps of cohorts are written in it; what runs them is asked for where somebody has a cohort.
set(CPACK_DEBIAN_COMMAND_PACKAGE_DEPENDS "python3:any")
set(CPACK_DEBIAN_COMMAND_PACKAGE_SUGGESTS "ecorche-doc, paraview, snakemake")
set(CPACK_COMPONENT_COMMAND_DESCRIPTION "pose a patient's whole anatomy
Prepares a body once, from skin and bones or from a scan, and then poses all
that is inside (muscles, organs, vessels, the scan itself) into files, or by
a server for headsets and browsers. For training and education, not for
planning surgery.")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SHLIBDEPS ON)
# Whoever is linked to them needs this version, or a later one of the same ABI; and the loader is told that they are there.
file(WRITE ${PROJECT_BINARY_DIR}/packages/shlibs "libecorche ${_soversion} ${_name_library} (>= ${PROJECT_VERSION})
libecorche_client ${_soversion} ${_name_library} (>= ${PROJECT_VERSION})\n")
file(WRITE ${PROJECT_BINARY_DIR}/packages/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/packages/shlibs ${PROJECT_BINARY_DIR}/packages/triggers)
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "pose prepared patients in process, or by a server (libraries)
Two libraries with a C interface: libecorche poses a prepared patient in
process, libecorche_client shows what a server poses.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEVELOPMENT_DEPENDS library)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4), pkg-config")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS "libhwy-dev, libtbb-dev, libhdf5-dev, libxxhash-dev, libssl-dev, libprotobuf-dev, libzstd-dev")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS "libexpat1-dev, zlib1g-dev, libyaml-cpp-dev, libtinygltf-dev, libvtk9-dev, libinsighttoolkit5-dev, libcgal-dev")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "pose prepared patients in process, or by a server (headers)
Headers for C and C++, static libraries, and what CMake's find_package and
pkg-config look for.")

set(CPACK_DEBIAN_PAGES_PACKAGE_SECTION doc)
set(CPACK_DEBIAN_PAGES_PACKAGE_ARCHITECTURE all)
set(CPACK_COMPONENT_PAGES_DESCRIPTION "pose a patient's whole anatomy (documentation)
Tutorials, how-to pages, reference and explanation of ecorche, as pages that
need no network, and example cases.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_COMPONENT_PYTHON_DEPENDS library)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3, python3-numpy")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/debian/python/postinst
  ${PROJECT_SOURCE_DIR}/packaging/debian/python/prerm)
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "pose prepared patients, as numpy arrays
The Python package ecorche: poses a prepared patient in process, or shows
what a server poses.")
include(CPack)
