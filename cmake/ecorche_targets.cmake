# SPDX-License-Identifier: Apache-2.0
include(GoogleTest OPTIONAL)

# ecorche_precompiled(TARGET PCH): the target reads PCH's headers precompiled, where ECORCHE_PCH is on.
function(ecorche_precompiled name pch)
  if(ECORCHE_PCH)
    target_precompile_headers(${name} REUSE_FROM ${pch})
  endif()
endfunction()

if(ECORCHE_PCH)
  find_package(Eigen3 3.4 REQUIRED NO_MODULE)
  find_package(GTest REQUIRED)
  file(WRITE ${CMAKE_BINARY_DIR}/pch.cpp "")
  set(_common <Eigen/Core> <Eigen/Geometry> <Eigen/LU> <algorithm> <filesystem> <functional> <map> <optional> <span>
    <string> <vector>)
  add_library(ecorche_pch OBJECT ${CMAKE_BINARY_DIR}/pch.cpp)
  target_link_libraries(ecorche_pch PRIVATE ecorche_flags ecorche_sanitizers Eigen3::Eigen)
  target_precompile_headers(ecorche_pch PRIVATE ${_common})
  add_library(ecorche_test_pch OBJECT ${CMAKE_BINARY_DIR}/pch.cpp)
  target_link_libraries(ecorche_test_pch PRIVATE ecorche_flags ecorche_sanitizers Eigen3::Eigen GTest::gtest)
  target_precompile_headers(ecorche_test_pch PRIVATE ${_common} <gtest/gtest.h>)
  # Without the time of making: what reads it can then be found in the cache again.
  target_compile_options(ecorche_flags INTERFACE "SHELL:-Xclang -fno-pch-timestamp")
endif()

# ecorche_library(NAME [FOREIGN] [CGAL] SOURCES ... [PUBLIC libs...] [PRIVATE libs...])
#   FOREIGN: mostly somebody else's templates (CGAL, ITK, VTK): built without sanitizers and with -O2 at most.
#   CGAL:    compiled in the job pool of one.
function(ecorche_library name)
  cmake_parse_arguments(A "FOREIGN;CGAL" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(${name} STATIC ${A_SOURCES})
  target_link_libraries(${name} PUBLIC ${A_PUBLIC} PRIVATE ecorche_flags ${A_PRIVATE})
  if(NOT A_FOREIGN)
    target_link_libraries(${name} PRIVATE ecorche_sanitizers)
    ecorche_precompiled(${name} ecorche_pch)
  elseif(ECORCHE_FUZZ)
    # libFuzzer goes where it sees branches: those of tinygltf decide what a glTF holds.
    target_compile_options(${name} PRIVATE -fsanitize=fuzzer-no-link,address)
  endif()
  if(A_CGAL)
    set_property(TARGET ${name} PROPERTY JOB_POOL_COMPILE cgal_pool)
  endif()
endfunction()

# What the sanitizers build.
add_custom_target(unit_tests)

# ecorche_test(NAME SOURCES ... [LIBS ...] [ARGS ...] [TIMEOUT seconds] [LABELS ...] [FIXTURES ...])
# One gtest executable and one ctest entry: a process start per case would cost more than the cases.
function(ecorche_test name)
  cmake_parse_arguments(A "" "TIMEOUT" "SOURCES;LIBS;ARGS;LABELS;FIXTURES" ${ARGN})
  if(NOT A_TIMEOUT)
    set(A_TIMEOUT 120)
  endif()
  find_package(GTest REQUIRED)
  add_executable(${name} ${A_SOURCES})
  target_link_libraries(${name} PRIVATE ecorche_flags ecorche_sanitizers ${A_LIBS} GTest::gtest GTest::gtest_main)
  # Tests themselves are compiled a fifth faster so; what they test keeps its own options.
  target_compile_options(${name} PRIVATE -O1)
  ecorche_precompiled(${name} ecorche_test_pch)
  if(name MATCHES "^unit_" AND NOT A_LABELS MATCHES "release_only|slow")
    add_dependencies(unit_tests ${name})
  endif()
  add_test(NAME ${name} COMMAND ${name} ${A_ARGS})
  ecorche_test_properties(${name} TIMEOUT ${A_TIMEOUT} LABELS ${A_LABELS} FIXTURES ${A_FIXTURES})
endfunction()

# ecorche_script_test(NAME COMMAND ... [TIMEOUT seconds] [LABELS ...] [FIXTURES ...]): a test that is not a gtest.
function(ecorche_script_test name)
  cmake_parse_arguments(A "" "TIMEOUT" "COMMAND;LABELS;FIXTURES" ${ARGN})
  if(NOT A_TIMEOUT)
    set(A_TIMEOUT 120)
  endif()
  add_test(NAME ${name} COMMAND ${A_COMMAND})
  ecorche_test_properties(${name} TIMEOUT ${A_TIMEOUT} LABELS ${A_LABELS} FIXTURES ${A_FIXTURES})
endfunction()

# Bodies of tests/fixtures reach a test by environment, so that the same executable runs by hand on any other body.
function(ecorche_test_properties name)
  cmake_parse_arguments(A "" "TIMEOUT" "LABELS;FIXTURES" ${ARGN})
  if(ECORCHE_SANITIZE)
    math(EXPR A_TIMEOUT "5 * ${A_TIMEOUT}")
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${A_TIMEOUT} LABELS "${A_LABELS}")
  if(NOT A_FIXTURES)
    return()
  endif()
  set(folder ${CMAKE_BINARY_DIR}/fixtures)
  set(first lattice)
  set(models ${folder}/small_lattice.hdf)
  if(ECORCHE_GPL)
    set(first cgal)
    set(models ${folder}/small_cgal.hdf:${folder}/small_tetgen.hdf:${models})
  endif()
  set(environment ECORCHE_BIN=${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/ecorche ECORCHE_CASE=${folder}/small
    ECORCHE_MODEL=${folder}/small_${first}.hdf ECORCHE_MODELS=${models}:${folder}/small_${first}_coarse.hdf
    ECORCHE_BAR_CASE=${folder}/bar ECORCHE_BAR_MODEL=${folder}/bar.hdf)
  set_tests_properties(${name} PROPERTIES FIXTURES_REQUIRED "${A_FIXTURES}" ENVIRONMENT "${environment}")
endfunction()
