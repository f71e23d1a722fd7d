// SPDX-License-Identifier: Apache-2.0
// A process that links the libraries keeps its own state: its threads, signal handlers, functions at exit,
// logger and OpenBLAS.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include <ecorche/model_file/model_file.hpp>
#include "io/image/image_file.hpp"
#include "io/surface/surface_file.hpp"
#include "preprocess/weights/harmonic.hpp"
#include "runtime/server/resources/journal.hpp"
#include "tests/support/toy_model.hpp"

namespace {

std::atomic<int> threads_started{0}, functions_at_exit{0};

}  // namespace

// Before those of the C library: what anything here starts or registers is counted.
// Seen by all libraries of the process, though ours show nothing.
#pragma GCC visibility push(default)
extern "C" {
int openblas_get_num_threads() __attribute__((weak));
void openblas_set_num_threads(int threads) __attribute__((weak));

int pthread_create(pthread_t* thread, const pthread_attr_t* how, void* (*run)(void*), void* with) {
  ++threads_started;
  static const auto next = reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  return next(thread, how, run, with);
}
int on_exit(void (*call)(int, void*), void* with) noexcept {
  ++functions_at_exit;
  static const auto next = reinterpret_cast<decltype(&on_exit)>(dlsym(RTLD_NEXT, "on_exit"));
  return next(call, with);
}
}
#pragma GCC visibility pop

namespace ecorche {
namespace {

struct State {
  std::set<std::string> tasks;
  std::vector<void (*)(int)> handlers;
  const spdlog::logger* logger = spdlog::default_logger_raw();
  spdlog::level::level_enum level = spdlog::get_level();
  int blas_threads = openblas_get_num_threads != nullptr ? openblas_get_num_threads() : 0;
  int started = threads_started, at_exit = functions_at_exit;

  State() {
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task"))
      tasks.insert(task.path().filename());
    for (int signal = 1; signal < NSIG; ++signal) {
      struct sigaction now {};
      if (sigaction(signal, nullptr, &now) == 0) handlers.push_back(now.sa_handler);
    }
  }
};

solve::SparseMatrix chain(int n) {
  solve::SparseMatrix A(n, n);
  for (int i = 0; i < n; ++i) {
    A.insert(i, i) = 4;
    if (i > 0) A.insert(i, i - 1) = A.insert(i - 1, i) = -1;
  }
  A.makeCompressed();
  return A;
}

TEST(Host, KeepsItsState) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);  // its arena, not ours
  if (openblas_set_num_threads != nullptr) openblas_set_num_threads(2);
  const auto folder = std::filesystem::temp_directory_path() / ("ecorche_host_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const State before;

  const Model model = test::toy_model();
  model_file::write(model, folder / "a.hdf", {});
  EXPECT_EQ(model_file::identity(model_file::read(folder / "a.hdf", {})), model_file::identity(model));
  Image image({.size = {2, 3, 4}}, ScalarType::u8);
  for (const char* name : {"a.nrrd", "a.mha", "a.nii.gz"}) {
    io::write_image(folder / name, image);
    EXPECT_EQ(io::read_image(folder / name).bytes, image.bytes);
  }
  for (const char* name : {"a.ply", "a.vtp", "a.glb"}) {
    io::write_surface(folder / name, {Points::Identity(3, 3), (Triangles(1, 3) << 0, 1, 2).finished()});
    EXPECT_EQ(io::read_surface(folder / name).F.rows(), 1);
  }
  std::stop_source stop;  // one that could ask for a stop: that was what threads were started for
  Context context;
  context.stop = stop.get_token();
  for (const std::string_view name : weights::solver_names()) {
    const auto solver = weights::make_solver(name);
    solver->factor(chain(500), context);
    EXPECT_EQ(solver->solve(solve::Block::Ones(500, 2), context).rows(), 500);
  }
  server::Journal(1).line(spdlog::level::debug, "a line");

  const State after;
  std::filesystem::remove_all(folder);
  EXPECT_EQ(after.tasks, before.tasks);
  EXPECT_EQ(after.started, before.started) << "threads were started";
  EXPECT_EQ(after.at_exit, before.at_exit) << "on_exit was called";
  EXPECT_EQ(after.handlers, before.handlers);
  EXPECT_EQ(after.logger, before.logger);
  EXPECT_EQ(after.level, before.level);
  EXPECT_EQ(after.blas_threads, before.blas_threads);
}

}  // namespace
}  // namespace ecorche
