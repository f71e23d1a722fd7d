// SPDX-License-Identifier: Apache-2.0
// Stands before a program (LD_PRELOAD) whose wall clock is to be stepped while it runs: by as many seconds as
// the file says that STEPPED_CLOCK names, eight bytes that are looked at each time. The steady clock goes on
// as it is, as on a machine whose date is set. (libfaketime moves both.)
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <ctime>

namespace {

std::int64_t step() {
  static const std::atomic<std::int64_t>* const seconds = [] {
    const char* const path = std::getenv("STEPPED_CLOCK");
    const int file = path == nullptr ? -1 : open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return static_cast<const std::atomic<std::int64_t>*>(nullptr);
    void* const seen = mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, file, 0);
    close(file);
    return seen == MAP_FAILED ? nullptr : static_cast<const std::atomic<std::int64_t>*>(seen);
  }();
  return seconds == nullptr ? 0 : seconds->load(std::memory_order_relaxed);
}

int real_time(clockid_t clock, timespec* time) {
  using Call = int (*)(clockid_t, timespec*);
  static const auto call = reinterpret_cast<Call>(dlsym(RTLD_NEXT, "clock_gettime"));
  return call(clock, time);
}

}  // namespace

extern "C" {
__attribute__((visibility("default"))) int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const int code = real_time(clock, time);
  if (code == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) time->tv_sec += step();
  return code;
}
__attribute__((visibility("default"))) int gettimeofday(timeval* time, void*) noexcept {
  timespec now{};
  const int code = clock_gettime(CLOCK_REALTIME, &now);
  *time = {now.tv_sec, now.tv_nsec / 1000};
  return code;
}
__attribute__((visibility("default"))) time_t time(time_t* out) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (out != nullptr) *out = now.tv_sec;
  return now.tv_sec;
}
}
