// SPDX-License-Identifier: Apache-2.0
#include "bench/server/walker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>

#include "proto/convert.hpp"
#include "proto/mesh_decoder.hpp"

namespace ecorche::bench {
namespace {

double ms(Clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

// When each pose of a session left, for those who watch it.
class Posed {
 public:
  void note(const std::string& session, std::uint64_t sequence) {
    const std::lock_guard lock(mutex_);
    auto& times = sessions_[session];
    times[sequence] = Clock::now();
    if (times.size() > 1024) times.erase(times.begin());
  }
  bool find(const std::string& session, std::uint64_t sequence, Clock::time_point& out) {
    const std::lock_guard lock(mutex_);
    const auto& times = sessions_[session];
    const auto found = times.find(sequence);
    if (found == times.end()) return false;
    out = found->second;
    return true;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::map<std::uint64_t, Clock::time_point>> sessions_;
};

Posed posed;

// Whole tissues, largest first, up to `vertices` together.
std::vector<std::string> tissues_of(const v1::ModelOpened& opened, std::size_t vertices, std::size_t& total) {
  std::vector<int> order(static_cast<std::size_t>(opened.tissues_size()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return opened.tissues(a).vertices() > opened.tissues(b).vertices(); });
  std::vector<std::string> names;
  total = 0;
  for (const int row : order) {
    const auto size = static_cast<std::size_t>(opened.tissues(row).vertices());
    if (vertices != 0 && total + size > vertices + vertices / 50) continue;
    total += size;
    names.push_back(opened.tissues(row).name());
  }
  return names;
}

}  // namespace

Pose walking(const Rig& rig, double seconds) {
  const auto& segments = rig.skeleton.segments;
  Pose pose = Pose::rest(segments.size());
  pose.root_translation = {15 * std::sin(2 * M_PI * seconds), -1300 * std::fmod(seconds, 60),
                           20 * std::cos(4 * M_PI * seconds)};
  for (std::size_t j = 1; j < segments.size(); ++j) {
    const std::string& name = segments[j].joint.name;
    const double phase = 2 * M_PI * seconds + (name.ends_with("_right") ? M_PI : 0);
    double degrees = 4 * std::sin(phase);
    if (name.starts_with("hip")) degrees = 5 + 22 * std::sin(phase);
    if (name.starts_with("knee")) degrees = 30 - 28 * std::cos(phase - 1);
    if (name.starts_with("ankle")) degrees = 10 * std::sin(phase + 1);
    if (name.starts_with("shoulder")) degrees = -18 * std::sin(phase);
    if (name.starts_with("elbow")) degrees = 25 - 12 * std::sin(phase);
    const auto& angle = segments[j].joint.sequence[0];
    const double sign = angle.sign;
    pose.rotation[j] = Eigen::AngleAxisd(sign * degrees * M_PI / 180, Eigen::Vector3d::Unit(angle.axis));
  }
  return pose;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

Walker::Walker(const wire::Address& address, const Asked& asked, double warm_up)
    : asked_(asked), warm_up_(warm_up), thread_([this, address] {
        try {
          run(address);
        } catch (const std::exception& error) {
          arrived_.error = error.what();
        }
      }) {}

const Arrived& Walker::finish() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  return arrived_;
}

void Walker::run(const wire::Address& address) {
  client::Client client(address, "bench");
  v1::Envelope open;
  open.mutable_open_model()->set_session(asked_.session);
  open.mutable_open_model()->set_without_triangles(true);
  const v1::ModelOpened opened = client.call(open).envelope.model_opened();
  Rig rig;
  if (const Status status = wire::from_proto(opened.skeleton(), rig); !status.ok())
    throw Error(ErrorKind::protocol, "bench", status.message, "see the server");
  v1::Envelope subscribe;
  v1::MeshSelection& mesh = *subscribe.mutable_subscribe()->mutable_mesh();
  mesh.set_encoding(asked_.encoding);
  for (const std::string& name : tissues_of(opened, asked_.vertices, arrived_.vertices))
    mesh.add_tissues(name);
  client.call(subscribe);

  // A session of one's own is known by the client.
  const std::string session =
      asked_.session.empty() ? std::to_string(reinterpret_cast<std::uintptr_t>(this)) : asked_.session;
  const auto start = Clock::now();
  const auto counts_from =
      start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(warm_up_));
  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(1 / std::max(asked_.rate, 1.0)));
  // Clients do not all pose at the same moment.
  Clock::time_point due =
      start + period * static_cast<int>(reinterpret_cast<std::uintptr_t>(this) / 64 % 97) / 97;
  std::uint64_t sequence = 0;
  wire::MeshDecoder decoder;
  std::vector<wire::DecodedTissue> decoded;
  while (!stop_) {
    if (asked_.rate > 0 && Clock::now() >= due) {
      v1::Envelope envelope;
      v1::PoseUpdate& update = *envelope.mutable_pose_update();
      update.set_sequence(++sequence);
      update.set_rig_digest(opened.rig_digest());
      wire::to_proto(walking(rig, static_cast<double>(sequence) / asked_.rate), update);
      posed.note(session, sequence);
      client.send(envelope);
      due = std::max(due + period, Clock::now() - period);
    }
    const auto until = asked_.rate > 0 ? due : Clock::now() + std::chrono::milliseconds(50);
    const auto frame = client.receive(until);
    if (!frame || !frame->envelope.has_mesh_frame()) continue;
    const auto now = Clock::now();
    const v1::MeshFrame& got = frame->envelope.mesh_frame();
    Clock::time_point sent;
    if (now >= counts_from) {
      ++arrived_.frames;
      arrived_.bytes += frame->payload.size();
      arrived_.posed_ms.push_back(static_cast<double>(got.timings().posed()) / 1e3);
      arrived_.encoded_ms.push_back(static_cast<double>(got.timings().encoded()) / 1e3);
      if (posed.find(session, got.pose_sequence(), sent)) arrived_.ms.push_back(ms(now - sent));
    }
    if (!asked_.decode) continue;
    if (const Status status = decoder.decode(got, frame->payload, decoded); !status.ok())
      throw Error(ErrorKind::protocol, "bench", status.message, "see the server");
    if (now >= counts_from) arrived_.decode_ms.push_back(ms(Clock::now() - now));
  }
  arrived_.seconds = std::chrono::duration<double>(Clock::now() - counts_from).count();
}

}  // namespace ecorche::bench
