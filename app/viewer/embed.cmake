# SPDX-License-Identifier: Apache-2.0
# Writes the viewer's files into a C++ source: cmake -D FOLDER=build/viewer -D OUT=viewer_files.cpp -P embed.cmake
# Of a file with its gzip file beside it (app.js, app.js.gz) the latter is taken. Without the folder there are no files. The
# source is left as it is where nothing has changed, so that nothing is compiled again.

set(files "")
if(EXISTS ${FOLDER}/index.html)
  file(GLOB_RECURSE files LIST_DIRECTORIES false RELATIVE ${FOLDER} ${FOLDER}/*)
  list(SORT files)
endif()

# What the source was made of stands in its second line.
set(made_of "")
foreach(file IN LISTS files)
  file(SHA256 ${FOLDER}/${file} hash)
  string(APPEND made_of "${file} ${hash} ")
endforeach()
string(SHA256 made_of "${made_of}")
if(EXISTS ${OUT})
  file(STRINGS ${OUT} head LIMIT_COUNT 2)
  if(head MATCHES "made of ${made_of}")
    return()
  endif()
endif()

set(arrays "")
set(rows "")
set(row 0)
foreach(file IN LISTS files)
  if(file MATCHES "\\.gz$")
    continue()
  endif()
  if(NOT file MATCHES "^[A-Za-z0-9_-][A-Za-z0-9._-]*(/[A-Za-z0-9_-][A-Za-z0-9._-]*)*$")
    message(FATAL_ERROR "error: ${FOLDER}/${file}: no name for a page's file (use letters, digits and ._-)")
  endif()
  file(SHA256 ${FOLDER}/${file} hash)
  string(SUBSTRING ${hash} 0 32 hash)
  file(SIZE ${FOLDER}/${file} plain_bytes)
  set(from ${file})
  set(gzip false)
  if(EXISTS ${FOLDER}/${file}.gz)
    set(from ${file}.gz)
    set(gzip true)
  endif()
  file(SIZE ${FOLDER}/${from} size)
  file(READ ${FOLDER}/${from} bytes HEX)
  string(REGEX REPLACE "(................................)" "\\1\n" bytes "${bytes}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
  # An array has one element at least.
  string(APPEND arrays "const unsigned char kData${row}[] = {\n${bytes}0};\n")
  string(APPEND rows "    {\"${file}\", kData${row}, ${size}, ${plain_bytes}, \"${hash}\", ${gzip}},\n")
  math(EXPR row "${row} + 1")
endforeach()

set(table "std::span<const server::EmbeddedFile> viewer_files() {\n  return {};\n}")
if(row GREATER 0)
  string(APPEND arrays "const server::EmbeddedFile kFiles[] = {\n${rows}};\n")
  set(table "std::span<const server::EmbeddedFile> viewer_files() {\n  return kFiles;\n}")
endif()
file(WRITE ${OUT} "// SPDX-License-Identifier: Apache-2.0
// Made by app/viewer/embed.cmake, made of ${made_of}
#include \"app/viewer/viewer_files.hpp\"

namespace ecorche::app {
namespace {

${arrays}
}  // namespace

${table}

}  // namespace ecorche::app
")
message(STATUS "viewer: ${row} files of ${FOLDER}")
