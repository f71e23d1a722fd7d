# SPDX-License-Identifier: Apache-2.0
# 64-bit Windows by Debian's mingw-w64 (threads by winpthreads, for std::mutex), against the libraries that
# scripts/windows_libraries builds; programs are run by Wine.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(CMAKE_AR x86_64-w64-mingw32-gcc-ar-posix)
set(CMAKE_RANLIB x86_64-w64-mingw32-gcc-ranlib-posix)

get_filename_component(_libraries ${CMAKE_CURRENT_LIST_DIR}/../build/libraries-windows ABSOLUTE)
set(CMAKE_FIND_ROOT_PATH ${_libraries} /usr/x86_64-w64-mingw32)
set(CMAKE_PREFIX_PATH ${_libraries})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_LIBDIR} ${_libraries}/lib/pkgconfig)
# Of Protobuf there is the lite library alone, which is all that is linked.
set(Protobuf_LIBRARY ${_libraries}/lib/libprotobuf-lite.a)
# Windows 10. gcc does not align vectors of 32 bytes on Windows' stack (its bug 54412), so nothing may be moved as if it were aligned.
# M_PI, in tests, has to be asked for.
foreach(_language C CXX)
  set(CMAKE_${_language}_FLAGS_INIT "-D_WIN32_WINNT=0x0A00 -D_USE_MATH_DEFINES -Wa,-muse-unaligned-vector-move")
endforeach()
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
set(CMAKE_SHARED_LINKER_FLAGS_INIT -static)
# As Debian keeps it, without the package that wraps it.
set(CMAKE_CROSSCOMPILING_EMULATOR /usr/lib/wine/wine64)
