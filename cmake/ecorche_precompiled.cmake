# SPDX-License-Identifier: Apache-2.0
# Precompiled headers: reading headers is most of what compiling one of our units takes. One set of headers a kind of unit:
#   plain    Eigen, TBB and the standard library
#   command  also CLI11, nlohmann_json and fmt
#   server   also Asio, Beast and Protobuf
# and for tests, which are executables: test, test_server (with GoogleTest).

# What only says what is to be done, the command and tests, is compiled a third faster with -O1. With sanitizers also the server's and its
# tests' units, which have no arithmetic: half of a unit's time goes into making it fast.
set(_light -O1)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # With it gcc 12 does not see that a value of std::optional is read only where there is one.
  list(APPEND _light -Wno-maybe-uninitialized)
endif()
set(ecorche_level_command ${_light})
set(ecorche_level_test ${_light})
set(ecorche_level_test_server ${_light})
if(ECORCHE_SANITIZE AND NOT ECORCHE_FUZZ)
  set(ecorche_level_command -O0)
  set(ecorche_level_server -O0)
  set(ecorche_level_test_server -O0)
endif()

# ecorche_precompiled(TARGET KIND): the target is compiled as that kind is, and reads its headers precompiled where ECORCHE_PCH is on.
function(ecorche_precompiled name kind)
  target_compile_options(${name} PRIVATE ${ecorche_level_${kind}})
  if(ECORCHE_PCH AND NOT kind STREQUAL "none")
    target_precompile_headers(${name} REUSE_FROM ecorche_pch_${kind})
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # Says in the preprocessed text which file was read: ccache asks for it.
      target_compile_options(${name} PRIVATE -fpch-preprocess)
    else()
      # Without the time of making: what reads it can then be found in the cache again.
      target_compile_options(${name} PRIVATE "SHELL:-Xclang -fno-pch-timestamp")
    endif()
  endif()
endfunction()

if(NOT ECORCHE_PCH)
  return()
endif()

find_package(Boost 1.74 REQUIRED)
find_package(CLI11 REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(GTest REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(Protobuf 3.21 REQUIRED)
find_package(spdlog REQUIRED)
find_package(TBB REQUIRED)

set(_standard <algorithm> <array> <atomic> <cmath> <cstdint> <deque> <filesystem> <functional> <limits> <map> <memory> <mutex>
  <numeric> <optional> <random> <set> <span> <sstream> <string> <string_view> <unordered_map> <utility> <variant> <vector>)
set(_plain ${_standard} <Eigen/Core> <Eigen/Geometry> <Eigen/LU> <tbb/blocked_range.h> <tbb/parallel_for.h> <tbb/task_arena.h>)
set(_command ${_standard} <chrono> <Eigen/Core> <Eigen/Geometry> <CLI/CLI.hpp> <fmt/format.h> <nlohmann/json.hpp>)
set(_server ${_standard} <chrono> <Eigen/Core> <Eigen/Geometry> ${PROJECT_SOURCE_DIR}/runtime/server/net/asio.hpp <boost/asio/read.hpp>
  <google/protobuf/message_lite.h> <google/protobuf/repeated_field.h>)

# ecorche_pch(KIND EXECUTABLE|LIBRARY HEADERS... LIBS...): an object library that only carries the headers.
function(ecorche_pch kind of)
  cmake_parse_arguments(A "" "" "HEADERS;LIBS" ${ARGN})
  set(name ecorche_pch_${kind})
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/pch_${kind}.cpp CONTENT "")
  add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/pch_${kind}.cpp)
  target_link_libraries(${name} PRIVATE ecorche_flags ecorche_sanitizers ${A_LIBS})
  target_compile_options(${name} PRIVATE ${ecorche_level_${kind}})
  if(of STREQUAL "EXECUTABLE")
    set_property(TARGET ${name} PROPERTY POSITION_INDEPENDENT_CODE OFF)
  endif()
  target_precompile_headers(${name} PRIVATE ${A_HEADERS})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${name} PRIVATE -fpch-preprocess)
  else()
    target_compile_options(${name} PRIVATE "SHELL:-Xclang -fno-pch-timestamp")
  endif()
endfunction()

ecorche_pch(plain LIBRARY HEADERS ${_plain} LIBS Eigen3::Eigen TBB::tbb)
ecorche_pch(command EXECUTABLE HEADERS ${_command} LIBS Eigen3::Eigen CLI11::CLI11 nlohmann_json::nlohmann_json spdlog::spdlog)
ecorche_pch(server LIBRARY HEADERS ${_server} LIBS Eigen3::Eigen Boost::headers protobuf::libprotobuf-lite)
ecorche_pch(test EXECUTABLE HEADERS ${_plain} <gtest/gtest.h> LIBS Eigen3::Eigen TBB::tbb GTest::gtest)
ecorche_pch(test_server EXECUTABLE HEADERS ${_server} <gtest/gtest.h>
  LIBS Eigen3::Eigen Boost::headers protobuf::libprotobuf-lite GTest::gtest)
