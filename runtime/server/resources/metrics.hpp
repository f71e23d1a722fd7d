// SPDX-License-Identifier: Apache-2.0
// What the server counts, in Prometheus' text format.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace ecorche::server {

/// For the I/O thread alone: workers' figures arrive with what they made.
class Metrics {
 public:
  Metrics();
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  /// A stage of a pose's way: `waited`, `posed`, `encoded`, `written` (until the client's socket took the
  /// frame).
  enum class Stage : std::uint8_t { waited, posed, encoded, written };
  void took(Stage stage, double seconds);

  void read(std::size_t bytes);
  void wrote(std::size_t bytes, bool frame);
  void skipped(std::uint64_t poses);
  /// A limit struck: `hello`, `frame`, `connections`, `sessions`, `subscriptions`, `kept`, `rate`, `stall`,
  /// `idle`, ...
  void hit(const char* limit);
  void denied();

  void set_clients(std::size_t count);
  void set_sessions(std::size_t count);
  /// Of MemoryBudget, bytes.
  void set_memory(std::uint64_t waiting, std::uint64_t kept);

  /// The whole page.
  std::string text() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ecorche::server
