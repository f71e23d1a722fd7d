// SPDX-License-Identifier: Apache-2.0
// A server's queues, without the server: how long clients wait for frames, by measured times of service.
#pragma once

#include <cstdint>
#include <vector>

namespace ecorche::bench {

/// One machine. All times in ms of processor.
struct MachineLoad {
  int cores = 2;
  int processes = 1;        ///< servers on it; sessions are dealt to them in turn
  int workers = 2;          ///< of each process
  std::size_t clients = 1;  ///< each poses a session of its own
  double rate = 90;         ///< poses a second, of each
  double seconds = 5;
  double fixed_ms = 0;       ///< on the way, whatever the load: network, kernel, waking
  std::vector<double> work;  ///< of a worker for a frame: drawn from these
  double io = 0.05;          ///< of a server's one I/O thread for a frame, its pose and its acknowledgements
  double client =
      0;  ///< of the one thread of clients for a frame, where they are on this machine; 0: they are not
  std::uint64_t seed = 1;
};

struct Waited {
  double p50 = 0, p99 = 0;  ///< ms, from a pose's sending to its frame's arrival
  double shown = 0;         ///< share of the poses that a frame showed
  double cores = 0;         ///< busy
};

/// The rules are the server's: one slot a session, in which the newest pose wins; one job a session at a
/// time; workers take sessions in the order in which they became ready; one I/O thread a process, whose short
/// work the system lets in before that of workers, as it does that of the clients' thread. Poses come at an
/// even pace, each client's at its own moment. The first second is not counted.
Waited simulate(const MachineLoad& load);

}  // namespace ecorche::bench
