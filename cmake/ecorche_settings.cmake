# SPDX-License-Identifier: Apache-2.0
# Language, warnings, optimisation and sanitizers, once for every target of ours.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
include(GNUInstallDirs)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
# Any library of ours may become part of a plug-in, and shows that plug-in's users nothing.
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
  if(ECORCHE_PCH)
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_DEPEND=1 ${CCACHE})
  endif()
endif()
# A CGAL mesh unit takes about 4 GB to compile: one at a time.
set_property(GLOBAL APPEND PROPERTY JOB_POOLS ecorche_cgal=1)

# There are dozens of executables to link, and lld links them in a tenth of the time.
find_program(LLD ld.lld)
if(LLD AND PROJECT_IS_TOP_LEVEL AND NOT CMAKE_CROSSCOMPILING)
  add_link_options(-fuse-ld=lld)
endif()

# gcc collects garbage from 128 MiB on, which is an eighth of its time; a unit of ours takes 1.5 GB without. Where there is room for
# that, it need not.
cmake_host_system_information(RESULT _memory QUERY TOTAL_PHYSICAL_MEMORY)
cmake_host_system_information(RESULT _processors QUERY NUMBER_OF_LOGICAL_CORES)
math(EXPR _share "${_memory} / ${_processors}")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND PROJECT_IS_TOP_LEVEL AND _share GREATER 4000)
  add_compile_options("SHELL:--param ggc-min-heapsize=4000000")
endif()

add_library(ecorche_flags INTERFACE)
target_include_directories(ecorche_flags INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(ecorche_flags INTERFACE -Wall -Wextra -Wpedantic -Wshadow)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # gcc 12 sees overlaps and impossible lengths in std::string's own operator+ (its bugs 105651, 105329).
  target_compile_options(ecorche_flags INTERFACE -Wno-restrict -Wno-stringop-overflow -Wno-array-bounds)
endif()

add_library(ecorche_sanitizers INTERFACE)
if(ECORCHE_SANITIZE)
  string(REPLACE ";" "," _sanitizers "${ECORCHE_SANITIZE}")
  target_compile_options(ecorche_sanitizers INTERFACE
    -fsanitize=${_sanitizers} -fno-sanitize-recover=all -fno-omit-frame-pointer -g1)
  # Undefined behaviour is looked for in our own code, not in what headers of the system make of it: a third of clang's
  # time went there. Addresses are watched everywhere.
  if(_sanitizers MATCHES "undefined")
    target_compile_options(ecorche_sanitizers INTERFACE
      -fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/cmake/undefined_behaviour.ignore)
  endif()
  # Kernels are compiled once per instruction set: here the plain one and AVX2 stand for all.
  target_compile_definitions(ecorche_sanitizers INTERFACE "HWY_DISABLED_TARGETS=(HWY_SSSE3|HWY_SSE4|HWY_AVX3|HWY_AVX3_DL)")
  # Linking needs the run-time library whoever links, also foreign units.
  add_link_options(-fsanitize=${_sanitizers})
endif()
if(ECORCHE_FUZZ)
  # Coverage, too, so that one build tells both what breaks and what was reached (scripts/fuzz).
  target_compile_options(ecorche_sanitizers INTERFACE -fsanitize=fuzzer-no-link -fprofile-instr-generate -fcoverage-mapping)
  add_link_options(-fprofile-instr-generate)
endif()
