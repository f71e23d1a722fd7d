// SPDX-License-Identifier: Apache-2.0
// Every thread that works for the server, by what it does.
#pragma once

#include <tbb/task_arena.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>

#include "runtime/server/net/asio.hpp"
#include "runtime/server/schedule/workers.hpp"

namespace ecorche::server {

/// What threads do. All but those of `frames` give way to whoever makes a frame of a mesh.
enum class Service : std::uint8_t {
  frames,        ///< poses, and frames of meshes: the workers that the server was given
  volumes,       ///< as many threads, which those of TBB help where no other arena has work for them
  planes,        ///< of volumes: as many again, so that they do not wait behind other sessions' volumes
  first_frames,  ///< what newcomers see beside a stream
  quality,       ///< of poses, measured where a core would else be idle
  background,    ///< what takes long, and nobody waits for but who asked
  levels,        ///< of detail, and packed triangles, that nobody waits for yet
  disposal,      ///< of what is large
  files,         ///< of recordings
};

/// Its destructor finishes all that was submitted, and then ends its threads; those of `frames` are not its
/// own.
class Executor {
 public:
  /// `around`, where there is one, is called in place of a job, and calls it: tests hold jobs back so.
  using Around = std::function<void(Service, const Job&)>;
  Executor(net::io_context& io, Workers& frames, Around around = nullptr);
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  /// From any thread. `work` must not throw. `by`: for whom; who had least comes first.
  void submit(Service service, Job work, std::shared_ptr<Account> by = nullptr);
  /// `work` there, which must not throw, then `then` on the I/O thread. There everything ends that both hold,
  /// so that no worker destroys what is not its own; io_context::run() does not return before.
  void run(Service service, std::function<void()> work, std::function<void()> then,
           std::shared_ptr<Account> by = nullptr);
  /// As run(), on the threads of `frames`, of which one is left for poses (where there are two): what else
  /// clients ask, however much, waits for the others. On the I/O thread.
  void run_request(std::function<void()> work, std::function<void()> then,
                   std::shared_ptr<Account> by = nullptr);
  /// Lets go of what is large on a thread of its own: giving back a GiB takes longer than a frame.
  void destroy_later(std::shared_ptr<const void> what) noexcept;

  /// Waits until nothing is queued there or runs.
  void drain(Service service) { workers(service).drain(); }

 private:
  Workers& workers(Service service);
  void start_requests();

  struct Request {
    std::function<void()> work, then;
    std::shared_ptr<Account> by;
  };

  net::io_context& io_;
  Workers& frames_;
  Around around_;
  std::deque<Request> requests_;      ///< wait for a worker
  std::size_t running_requests_ = 0;  ///< have one
  tbb::task_arena volume_arena_, plane_arena_;
  Workers quality_, first_frames_, files_, background_, disposal_, levels_, volumes_, planes_;
};

}  // namespace ecorche::server
