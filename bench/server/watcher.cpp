// SPDX-License-Identifier: Apache-2.0
#include "bench/server/watcher.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include <ecorche/client/client.hpp>
#include <ecorche/values/error.hpp>
#include <ecorche/wire/convert.hpp>

namespace ecorche::bench {
namespace {

constexpr std::uint32_t kPixels = 512;  // each way

v1::ModelOpened open(client::Client& client, const std::string& session) {
  v1::Envelope open;
  open.mutable_open_model()->set_session(session);
  open.mutable_open_model()->set_without_triangles(true);
  return client.call(open).envelope.model_opened();
}

void set(v1::Vector3& out, double x, double y, double z) {
  out.set_x(x);
  out.set_y(y);
  out.set_z(z);
}

}  // namespace

Watcher::Watcher(const Served& served, const std::string& session, v1::VolumeSelection selection)
    : thread_([this, address = served.address(), session, selection = std::move(selection)] {
        try {
          watch(address, session, selection);
        } catch (const std::exception& error) {
          error_ = error.what();
        }
      }) {}

Watcher::~Watcher() {
  stop();
}

void Watcher::stop() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

void Watcher::watch(const wire::Address& address, const std::string& session, v1::VolumeSelection selection) {
  client::Client client(address, "bench");
  const v1::ModelOpened opened = open(client, session);
  if (selection.volume().empty()) selection.set_volume(opened.volumes(0).name());
  v1::Envelope subscribe;
  *subscribe.mutable_subscribe()->mutable_volume() = std::move(selection);
  client.call(subscribe);
  while (!stopping_) {
    const auto frame = client.receive(client::Clock::now() + std::chrono::milliseconds(100));
    if (!frame || !frame->envelope.has_volume_frame()) continue;
    if (const auto& status = frame->envelope.volume_frame().status(); status.code() != 0)
      throw client::ServerError("volume", status);
    ++frames_;
    bytes_ += frame->payload.size();
  }
}

v1::VolumeSelection middle_plane(const Served& served) {
  client::Client client(served.address(), "bench");
  const v1::ModelOpened opened = open(client, {});
  ImageGrid grid;
  if (opened.volumes_size() == 0 || !wire::from_proto(opened.volumes(0).grid(), grid).ok())
    throw Error(ErrorKind::usage, "bench", "the model has no volume", "give another model");
  const auto far = [&](std::size_t a) { return grid.size[a] - 1; };
  const std::int32_t middle = far(2) / 2;
  const auto corner = grid.point(0, 0, middle), along = grid.point(far(0), 0, middle),
             across = grid.point(0, far(1), middle);
  v1::VolumeSelection selection;
  selection.set_volume(opened.volumes(0).name());
  v1::Slice& slice = *selection.add_slices();
  const double steps = kPixels - 1;
  set(*slice.mutable_origin(), corner[0], corner[1], corner[2]);
  set(*slice.mutable_u(), (along[0] - corner[0]) / steps, (along[1] - corner[1]) / steps,
      (along[2] - corner[2]) / steps);
  set(*slice.mutable_v(), (across[0] - corner[0]) / steps, (across[1] - corner[1]) / steps,
      (across[2] - corner[2]) / steps);
  slice.set_size_u(kPixels);
  slice.set_size_v(kPixels);
  return selection;
}

}  // namespace ecorche::bench
