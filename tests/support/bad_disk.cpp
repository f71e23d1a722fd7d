// SPDX-License-Identifier: Apache-2.0
// Loaded before a command (LD_PRELOAD): a disk that keeps something else than it was given. Of every block
// of at least 32 KiB (arrays, not their descriptions) the middle byte comes out changed.
#include <dlfcn.h>
#include <unistd.h>

#include <cstddef>
#include <vector>

// Seen by all libraries of the process, though ours show nothing.
#pragma GCC visibility push(default)
extern "C" ssize_t pwrite(int file, const void* bytes, std::size_t size, off_t place) {
  using Write = ssize_t (*)(int, const void*, std::size_t, off_t);
  static const auto real = reinterpret_cast<Write>(dlsym(RTLD_NEXT, "pwrite"));
  if (size < 32768) return real(file, bytes, size, place);
  const auto* from = static_cast<const char*>(bytes);
  std::vector<char> spoilt(from, from + size);
  spoilt[size / 2] = static_cast<char>(spoilt[size / 2] ^ 1);
  return real(file, spoilt.data(), size, place);
}

extern "C" ssize_t pwrite64(int file, const void* bytes, std::size_t size, off_t place) {
  return pwrite(file, bytes, size, place);
}
#pragma GCC visibility pop
