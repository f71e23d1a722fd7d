// SPDX-License-Identifier: Apache-2.0
#include "tests/support/peak_memory.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <exception>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace ecorche::test {
namespace {

// A line `key: N kB` of the kernel's account of this process, in bytes.
std::uint64_t status_bytes(const std::string& key) {
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(key + ":")) return std::stoull(line.substr(key.size() + 1)) * 1024;
  }
  throw std::runtime_error("no " + key + " in /proc/self/status");
}

std::string told(const std::function<void()>& work) {
  try {
    work();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

}  // namespace

Peak peak_of(const std::function<void()>& work) {
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
  const ::pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    // A new process begins with what its parent had touched at most.
    std::ofstream("/proc/self/clear_refs") << "5";
    const std::uint64_t before = status_bytes("VmRSS");
    const std::string error = told(work);
    const std::uint64_t peak = status_bytes("VmHWM");
    const std::string line = std::to_string(peak > before ? peak - before : 0) + "\n" + error;
    const bool said = ::write(ends[1], line.data(), line.size()) == static_cast<::ssize_t>(line.size());
    ::_exit(said ? 0 : 1);
  }
  ::close(ends[1]);
  std::string line;
  char buffer[4096];
  for (::ssize_t n = 0; (n = ::read(ends[0], buffer, sizeof buffer)) > 0;)
    line.append(buffer, static_cast<std::size_t>(n));
  ::close(ends[0]);
  int status = 0;
  if (::waitpid(child, &status, 0) != child || status != 0 || line.empty())
    throw std::runtime_error("the process that was measured ended by " + std::to_string(status));
  const std::size_t end = line.find('\n');
  return {std::stoull(line.substr(0, end)), line.substr(end + 1)};
}

}  // namespace ecorche::test
