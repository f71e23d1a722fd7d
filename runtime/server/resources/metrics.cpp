// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/resources/metrics.hpp"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <array>

namespace ecorche::server {
namespace {

// Seconds; a frame at 90 Hz has 0.011.
const prometheus::Histogram::BucketBoundaries kBuckets{0.0001, 0.00025, 0.0005, 0.001, 0.002, 0.004,
                                                       0.006,  0.008,   0.011,  0.016, 0.033, 0.066,
                                                       0.1,    0.25,    0.5,    1,     2.5,   10};

}  // namespace

struct Metrics::Impl {
  prometheus::Registry registry;

  prometheus::Counter& counter(const char* name, const char* help) {
    return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add({});
  }
  prometheus::Gauge& gauge(const char* name, const char* help) {
    return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add({});
  }

  prometheus::Family<prometheus::Histogram>& stages = prometheus::BuildHistogram()
                                                          .Name("ecorche_stage_seconds")
                                                          .Help("Time that poses and frames take, by stage")
                                                          .Register(registry);
  std::array<prometheus::Histogram*, 4> stage{
      &stages.Add({{"stage", "waited"}}, kBuckets), &stages.Add({{"stage", "posed"}}, kBuckets),
      &stages.Add({{"stage", "encoded"}}, kBuckets), &stages.Add({{"stage", "written"}}, kBuckets)};
  prometheus::Counter& frames = counter("ecorche_frames_sent_total", "Frames written whole to clients");
  prometheus::Counter& sent = counter("ecorche_sent_bytes_total", "Bytes written to clients");
  prometheus::Counter& received = counter("ecorche_received_bytes_total", "Bytes read from clients");
  prometheus::Counter& skips = counter("ecorche_poses_skipped_total", "Poses that newer ones overtook");
  prometheus::Counter& denials = counter("ecorche_denied_total", "Connections without the right token");
  prometheus::Gauge& clients = gauge("ecorche_clients", "Connections that speak the protocol");
  prometheus::Gauge& sessions = gauge("ecorche_sessions", "Sessions, also those that wait for their clients");
  prometheus::Gauge& waiting = gauge("ecorche_waiting_bytes", "Bytes of frames that wait for clients");
  prometheus::Gauge& kept = gauge("ecorche_kept_bytes", "Bytes that subscriptions and probes keep, about");
  prometheus::Family<prometheus::Counter>& limits = prometheus::BuildCounter()
                                                        .Name("ecorche_limits_hit_total")
                                                        .Help("How often which limit struck")
                                                        .Register(registry);
};

Metrics::Metrics() : impl_(std::make_unique<Impl>()) {}
Metrics::~Metrics() = default;

void Metrics::took(Stage stage, double seconds) {
  impl_->stage[static_cast<std::size_t>(stage)]->Observe(seconds);
}

void Metrics::read(std::size_t bytes) {
  impl_->received.Increment(static_cast<double>(bytes));
}

void Metrics::wrote(std::size_t bytes, bool frame) {
  impl_->sent.Increment(static_cast<double>(bytes));
  if (frame) impl_->frames.Increment();
}

void Metrics::skipped(std::uint64_t poses) {
  impl_->skips.Increment(static_cast<double>(poses));
}

void Metrics::hit(const char* limit) {
  impl_->limits.Add({{"limit", limit}}).Increment();
}

void Metrics::denied() {
  impl_->denials.Increment();
}

void Metrics::set_clients(std::size_t count) {
  impl_->clients.Set(static_cast<double>(count));
}

void Metrics::set_sessions(std::size_t count) {
  impl_->sessions.Set(static_cast<double>(count));
}

void Metrics::set_memory(std::uint64_t waiting, std::uint64_t kept) {
  impl_->waiting.Set(static_cast<double>(waiting));
  impl_->kept.Set(static_cast<double>(kept));
}

std::string Metrics::text() const {
  return prometheus::TextSerializer().Serialize(impl_->registry.Collect());
}

}  // namespace ecorche::server
