// SPDX-License-Identifier: Apache-2.0
#include "bench/server/served.hpp"

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include <ecorche/values/error.hpp>

extern char** environ;

namespace ecorche::bench {

Served::Served(const std::string& program, const std::string& model, const std::vector<std::string>& options)
    : port_file_(
          (std::filesystem::temp_directory_path() / ("ecorche-bench-" + std::to_string(getpid()))).string()) {
  std::filesystem::remove(port_file_);
  std::vector<std::string> words{program,       "serve",    model,   "--listen", "127.0.0.1:0",
                                 "--port-file", port_file_, "--log", "error"};
  words.insert(words.end(), options.begin(), options.end());
  if (const char* more = std::getenv("SERVE_OPTIONS")) {
    std::istringstream given(more);
    for (std::string word; given >> word;) words.push_back(word);
  }
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  posix_spawn_file_actions_addopen(&quiet, STDOUT_FILENO, "/dev/null", 1, 0);
  const int failed = posix_spawn(&pid_, program.c_str(), &quiet, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&quiet);
  const auto lost = [&] {
    return Error(ErrorKind::temporary, program, "does not serve " + model, "run it by hand");
  };
  if (failed != 0) throw lost();
  while (!std::filesystem::exists(port_file_)) {
    if (waitpid(pid_, nullptr, WNOHANG) == pid_) {
      pid_ = -1;
      throw lost();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  std::ifstream(port_file_) >> address_.port >> http_.port;
  address_.host = http_.host = "127.0.0.1";
}

Served::~Served() {
  if (pid_ > 0) {
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }
  std::filesystem::remove(port_file_);
}

double Served::rss_mib() const {
  std::ifstream status("/proc/" + std::to_string(pid_) + "/statm");
  double all = 0, resident = 0;
  status >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

std::size_t Served::descriptors() const {
  const std::filesystem::directory_iterator folder("/proc/" + std::to_string(pid_) + "/fd");
  return static_cast<std::size_t>(std::distance(begin(folder), end(folder)));
}

double Served::cpu_seconds() const {
  std::ifstream stat("/proc/" + std::to_string(pid_) + "/stat");
  std::string line;
  std::getline(stat, line);
  std::istringstream rest(line.substr(line.rfind(')') + 2));
  std::string word;
  double user = 0, system = 0;
  for (int field = 3; field <= 13; ++field) rest >> word;
  rest >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

}  // namespace ecorche::bench
