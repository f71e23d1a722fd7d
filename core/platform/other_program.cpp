// SPDX-License-Identifier: Apache-2.0
#include "core/platform/other_program.hpp"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <thread>

#include <ecorche/values/error.hpp>

namespace ecorche::platform {
namespace {

constexpr int kCannotStart = 127;

[[noreturn]] void become(const std::filesystem::path& program, std::vector<char*>& words, pid_t parent) {
  // A group of its own: a Ctrl-C of the terminal reaches us alone, and it once, by us.
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGINT);
  if (getppid() != parent) _exit(kCannotStart);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  execv(program.c_str(), words.data());
  _exit(kCannotStart);
}

}  // namespace

std::optional<std::filesystem::path> find_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::filesystem::path file = std::filesystem::path(folder.empty() ? "." : folder) / name;
    std::error_code ignored;
    if (std::filesystem::is_regular_file(file, ignored) && access(file.c_str(), X_OK) == 0) return file;
  }
  return std::nullopt;
}

int run_program(const std::filesystem::path& program, const std::vector<std::string>& words,
                const std::stop_token& stop) {
  // Made before the fork: the child may not allocate.
  std::string name = program.string();
  std::vector<std::string> kept = words;
  std::vector<char*> arguments{name.data()};
  for (std::string& word : kept) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const pid_t parent = getpid(), child = fork();
  if (child < 0) {
    throw Error(ErrorKind::internal, name, std::string("cannot be started: ") + std::strerror(errno),
                "free some memory and try again");
  }
  if (child == 0) become(program, arguments, parent);
  setpgid(child, child);  // whoever of us comes first
  bool told = false;
  int status = 0;
  for (;;) {
    const pid_t ended = waitpid(child, &status, WNOHANG);
    if (ended == child) break;
    if (ended < 0 && errno != EINTR)
      throw Error(ErrorKind::internal, name, std::string("cannot be waited for: ") + std::strerror(errno),
                  "report this");
    if (stop.stop_requested() && !told) {
      kill(-child, SIGINT);
      told = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace ecorche::platform
