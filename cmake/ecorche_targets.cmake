# SPDX-License-Identifier: Apache-2.0
# ecorche_library(NAME [FOREIGN] [CGAL] [PRECOMPILED kind] [HEADERS folder] SOURCES ... [KERNELS ...] [PUBLIC libs...] [PRIVATE libs...])
#   HEADERS:     its public headers stand in that folder: <ecorche/...>.
#   FOREIGN:     mostly somebody else's templates (CGAL, ITK, VTK): built without sanitizers and precompiled headers.
#   CGAL:        compiled in the job pool of one.
#   PRECOMPILED: which headers (ecorche_precompiled.cmake); `plain` where it is not said, `none` for none.
#   KERNELS:     sources that Highway compiles once per instruction set.
function(ecorche_library name)
  cmake_parse_arguments(A "FOREIGN;CGAL" "PRECOMPILED;HEADERS" "SOURCES;KERNELS;PUBLIC;PRIVATE" ${ARGN})
  if(NOT A_PRECOMPILED)
    set(A_PRECOMPILED plain)
  endif()
  if(A_FOREIGN)
    ecorche_finished_objects(${name} A_SOURCES)
  endif()
  add_library(${name} STATIC ${A_SOURCES} ${A_KERNELS})
  set_property(TARGET ${name} PROPERTY LINKER_LANGUAGE CXX)
  # A kernel includes itself again and again, so it stands alone. Intel's intrinsics, read from a precompiled header,
  # make gcc 12 warn of its own headers.
  set_source_files_properties(${A_KERNELS} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON SKIP_PRECOMPILE_HEADERS ON)
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_link_libraries(${name} PUBLIC ${A_PUBLIC} PRIVATE $<BUILD_INTERFACE:ecorche_flags> ${A_PRIVATE})
  # On ARM NEON alone: kernels keep vectors in structs, which SVE's have no size for. AES is what Highway asks of NEON.
  if(A_KERNELS AND CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
    target_compile_definitions(${name} PUBLIC "HWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)")
    target_compile_options(${name} PRIVATE -march=armv8-a+crypto)
  endif()
  if(A_HEADERS)
    target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/${A_HEADERS}>)
  endif()
  if(NOT A_FOREIGN)
    target_link_libraries(${name} PRIVATE $<BUILD_INTERFACE:ecorche_sanitizers>)
    ecorche_precompiled(${name} ${A_PRECOMPILED})
    ecorche_unity(${name})
  elseif(ECORCHE_FUZZ)
    # libFuzzer goes where it sees branches: those of tinygltf decide what a glTF holds.
    target_compile_options(${name} PRIVATE -fsanitize=fuzzer-no-link,address -fprofile-instr-generate -fcoverage-mapping)
  else()
    ecorche_list_objects(${name})
  endif()
  if(A_CGAL)
    set_property(TARGET ${name} PROPERTY JOB_POOL_COMPILE ecorche_cgal)
  endif()
endfunction()

# ecorche_unity(TARGET): its sources are compiled 24 at a time, as one: what they share is then read, instantiated and
# optimised once. With ECORCHE_UNITY off each is compiled alone.
function(ecorche_unity name)
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${ECORCHE_UNITY} UNITY_BUILD_BATCH_SIZE 24)
endfunction()

# What the sanitizers build.
if(ECORCHE_TESTS)
  add_custom_target(unit_tests)
endif()

# ecorche_test(NAME [SANITIZED] SOURCES ... [LIBS ...] [ARGS ...] [PRECOMPILED kind] [TIMEOUT seconds] [LABELS ...]
#   [FIXTURES ...])
# One gtest executable and one ctest entry: a process start per case would cost more than the cases.
#   SANITIZED: its sources depend on sanitizers or on ECORCHE_GPL: never taken from another tree (ecorche_finished.cmake).
function(ecorche_test name)
  cmake_parse_arguments(A "SANITIZED" "PRECOMPILED;TIMEOUT" "SOURCES;LIBS;ARGS;LABELS;FIXTURES" ${ARGN})
  if(NOT A_PRECOMPILED)
    set(A_PRECOMPILED test)
  endif()
  if(NOT A_TIMEOUT)
    set(A_TIMEOUT 120)
  endif()
  find_package(GTest REQUIRED)
  set(sources ${A_SOURCES})
  if(NOT A_SANITIZED)
    ecorche_finished_objects(${name} A_SOURCES)
  endif()
  add_executable(${name} ${A_SOURCES})
  set_property(TARGET ${name} PROPERTY LINKER_LANGUAGE CXX)
  target_link_libraries(${name} PRIVATE ecorche_flags ecorche_sanitizers ${A_LIBS} GTest::gtest GTest::gtest_main)
  ecorche_unity(${name})
  if(A_SOURCES STREQUAL sources)
    ecorche_precompiled(${name} ${A_PRECOMPILED})
    ecorche_list_objects(${name})
  else()
    ecorche_link_first(${name} ${A_LIBS})
  endif()
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

# Where no earlier run told ctest what tests take: the longest ones, half a minute to one, longest first. Begun late, each would keep one
# processor after all others are done.
set(ecorche_longest_tests unit_server e2e_new property_mapping e2e_outside unit_server_memory e2e_cohort e2e_unity e2e_pose_scan
  e2e_label_body e2e_ct_alone e2e_determinism unit_rig e2e_way_back e2e_stream_test e2e_cache e2e_nameless e2e_calibrate unit_pipeline
  unit_io_images_elsewhere unit_tet e2e_odd_surfaces e2e_fem e2e_cohort_samples e2e_stops)

# Bodies of tests/fixtures reach a test by environment, so that the same executable runs by hand on any other body.
function(ecorche_test_properties name)
  cmake_parse_arguments(A "" "TIMEOUT" "LABELS;FIXTURES" ${ARGN})
  if(ECORCHE_SANITIZE OR CMAKE_CROSSCOMPILING)
    math(EXPR A_TIMEOUT "5 * ${A_TIMEOUT}")
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${A_TIMEOUT} LABELS "${A_LABELS}")
  list(FIND ecorche_longest_tests ${name} place)
  if(NOT place EQUAL -1)
    math(EXPR cost "500 - ${place}")
    set_tests_properties(${name} PROPERTIES COST ${cost})
  endif()
  if(NOT A_FIXTURES)
    return()
  endif()
  set(folder ${PROJECT_BINARY_DIR}/fixtures)
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
