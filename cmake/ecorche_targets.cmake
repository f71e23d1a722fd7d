# SPDX-License-Identifier: Apache-2.0
include(GoogleTest OPTIONAL)

# ecorche_library(NAME [FOREIGN] [CGAL] SOURCES ... [PUBLIC libs...] [PRIVATE libs...])
#   FOREIGN: mostly somebody else's templates (CGAL, ITK, VTK): built without sanitizers and with -O2 at most.
#   CGAL:    compiled in the job pool of one.
function(ecorche_library name)
  cmake_parse_arguments(A "FOREIGN;CGAL" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(${name} STATIC ${A_SOURCES})
  target_link_libraries(${name} PUBLIC ${A_PUBLIC} PRIVATE ecorche_flags ${A_PRIVATE})
  if(NOT A_FOREIGN)
    target_link_libraries(${name} PRIVATE ecorche_sanitizers)
  endif()
  if(A_CGAL)
    set_property(TARGET ${name} PROPERTY JOB_POOL_COMPILE cgal_pool)
  endif()
endfunction()

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
  add_test(NAME ${name} COMMAND ${name} ${A_ARGS})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${A_TIMEOUT} LABELS "${A_LABELS}")
  if(A_FIXTURES)
    set_tests_properties(${name} PROPERTIES FIXTURES_REQUIRED "${A_FIXTURES}")
  endif()
endfunction()
