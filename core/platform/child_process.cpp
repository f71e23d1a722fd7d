// SPDX-License-Identifier: Apache-2.0
#include "core/platform/child_process.hpp"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <thread>

namespace ecorche::platform {
namespace {

Error system_error(const char* what, const std::string& mend) {
  return {ErrorKind::internal, "child process", std::string(what) + ": " + std::strerror(errno), mend};
}

/// An unnamed file in memory, which parent and child share.
class MemoryFile {
 public:
  MemoryFile(const char* name, const std::string& mend) : fd_(memfd_create(name, 0)), mend_(mend) {
    if (fd_ < 0) throw system_error("cannot make a file in memory", mend_);
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int fd() const { return fd_; }

  bool write_all(const std::vector<std::byte>& bytes) const {
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t n = write(fd_, bytes.data() + done, bytes.size() - done);
      if (n <= 0) return false;
      done += static_cast<std::size_t>(n);
    }
    return true;
  }

  std::vector<std::byte> read_all() const {
    struct stat info {};
    if (fstat(fd_, &info) != 0) throw system_error("cannot read the child's result", mend_);
    std::vector<std::byte> bytes(static_cast<std::size_t>(info.st_size));
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t n = pread(fd_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
      if (n <= 0) throw system_error("cannot read the child's result", mend_);
      done += static_cast<std::size_t>(n);
    }
    return bytes;
  }

 private:
  int fd_;
  const std::string& mend_;
};

std::string last_line(const std::vector<std::byte>& bytes) {
  std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  const std::size_t line = text.rfind('\n');
  return line == std::string::npos ? text : text.substr(line + 1);
}

void limit_memory(std::uint64_t more) {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t pages = 0;
  if (!(statm >> pages)) return;
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0) return;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, pages * static_cast<std::uint64_t>(getpagesize()) + more);
  setrlimit(RLIMIT_AS, &limit);
}

[[noreturn]] void be_child(const std::function<std::vector<std::byte>()>& work, const ChildOptions& options,
                           pid_t parent, const MemoryFile& result, const MemoryFile& log) {
  // Signals stay blocked as in the parent, which decides: a Ctrl-C reaches both.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);  // it died in between
  dup2(log.fd(), STDOUT_FILENO);
  dup2(log.fd(), STDERR_FILENO);
  limit_memory(options.bytes);
  int code = 1;
  try {
    code = result.write_all(work()) ? 0 : 1;
  } catch (const std::exception& e) {
    std::printf("%s\n", e.what());
  } catch (...) {  // a number, say; libraries have then printed why
  }
  std::fflush(nullptr);
  _exit(code);  // no destructors of the parent's objects
}

}  // namespace

ChildResult run_in_child(const std::function<std::vector<std::byte>()>& work, const ChildOptions& options,
                         const Context& context) {
  const MemoryFile result("result", options.mend), log("log", options.mend);
  std::fflush(nullptr);  // or the child would print the parent's pending output again
  const pid_t parent = getpid(), child = fork();
  if (child < 0) throw system_error("cannot start a process", options.mend);
  if (child == 0) be_child(work, options, parent, result, log);

  const auto start = std::chrono::steady_clock::now();
  const auto end_child = [&](int& status) {
    kill(child, SIGKILL);
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  };
  int status = 0;
  ChildResult out;
  for (;;) {
    const pid_t ended = waitpid(child, &status, WNOHANG);
    if (ended == child) break;
    if (ended < 0 && errno != EINTR) throw system_error("cannot wait for the process", options.mend);
    if (context.stop.stop_requested()) {
      end_child(status);
      context.check_stop();
    }
    const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (spent > options.seconds) {
      end_child(status);
      out.end = ChildResult::End::timed_out;
      return out;
    }
    context.report(spent / (spent + 20));  // it does not tell: slower and slower towards the end
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    out.end = ChildResult::End::done;
    out.bytes = result.read_all();
  } else {
    out.said = last_line(log.read_all());
    if (WIFSIGNALED(status))
      out.said += (out.said.empty() ? "" : "; ") + std::string(strsignal(WTERMSIG(status)));
  }
  return out;
}

}  // namespace ecorche::platform
