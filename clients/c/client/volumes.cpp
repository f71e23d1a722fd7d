// SPDX-License-Identifier: Apache-2.0
// Posed volumes, as frames bring them.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <ecorche/wire/convert.hpp>
#include "clients/c/client/connection.hpp"
#include "clients/c/grid.hpp"
#include "proto/arrays.hpp"

namespace ecorche::c {
namespace {

// docs/reference/protocol.md
constexpr std::size_t kMostSlices = 16;

void set(v1::Vector3& out, const double* xyz, double times = 1) {
  out.set_x(times * xyz[0]);
  out.set_y(times * xyz[1]);
  out.set_z(times * xyz[2]);
}

// The plane of the grid's voxels.
void to_wire(const ImageGrid& grid, v1::Slice& out) {
  const auto axis = [&](std::size_t a, v1::Vector3& along) {
    const double column[3] = {grid.direction[a], grid.direction[a + 3], grid.direction[a + 6]};
    set(along, column, grid.spacing[a]);
  };
  set(*out.mutable_origin(), grid.origin.data());
  axis(0, *out.mutable_u());
  axis(1, *out.mutable_v());
  out.set_size_u(static_cast<std::uint32_t>(grid.size[0]));
  out.set_size_v(static_cast<std::uint32_t>(grid.size[1]));
}

// Fills what the stream wants. Throws Error{usage} for options that are none.
void read_options(const ecorche_volume_options& options, const std::string& name, VolumeStream& out) {
  if (options.deformer != ECORCHE_DEFORMER_TETS && options.deformer != ECORCHE_DEFORMER_SPHERES)
    throw Error(ErrorKind::usage, "deformer", "there is no such deformer", "see ecorche_deformer");
  if ((options.slices == nullptr) != (options.slice_count == 0) || options.slice_count > kMostSlices)
    throw Error(ErrorKind::usage, "slices", "are none, or more than 16", "NULL and 0 for the volume");
  v1::VolumeSelection& selection = *out.wanted.mutable_volume();
  selection.set_volume(name);
  selection.set_nearest(options.nearest != 0);
  selection.set_deformer(static_cast<v1::Deformer>(options.deformer));
  selection.set_compressed(options.compressed != 0);
  selection.set_changed_bricks(options.slices == nullptr);
  if (options.region != nullptr) {
    set(*selection.mutable_region()->mutable_min(), options.region);
    set(*selection.mutable_region()->mutable_max(), options.region + 3);
  }
  for (std::size_t s = 0; s < options.slice_count; ++s) {
    const ImageGrid grid = read_grid(options.slices[s]);
    if (grid.size[2] != 1)
      throw Error(ErrorKind::usage, "slices", "one is not one voxel thick along k", "set size[2] to 1");
    to_wire(grid, *selection.add_slices());
    out.slices.push_back(options.slices[s]);
  }
  out.wanted.set_max_rate(options.max_rate);
}

const VolumeStream* find(const ecorche_client& client, std::uint32_t number) {
  const auto found = std::find_if(client.volumes.begin(), client.volumes.end(),
                                  [&](const VolumeStream& one) { return one.number == number; });
  return found == client.volumes.end() ? nullptr : &*found;
}

ecorche_code no_stream(std::uint32_t number) {
  return fail(ECORCHE_NOT_FOUND,
              "stream " + std::to_string(number) + ": there is none (see ecorche_client_subscribe_volume)");
}

ecorche_code no_volume(const OpenedBody& body, std::uint32_t volume) {
  return fail(ECORCHE_INVALID_ARGUMENT, "volume " + std::to_string(volume) + ": the model has " +
                                            std::to_string(body.volumes.size()) + " of them");
}

// Whether what was decoded is what the stream is of.
bool fits(const VolumeStream& stream, const v1::Volume& volume) {
  std::size_t voxels = 0;
  for (const ecorche_grid& slice : stream.slices)
    voxels += static_cast<std::size_t>(slice.size[0]) * static_cast<std::size_t>(slice.size[1]);
  return wire::to_proto(stream.shown.type) == volume.type() &&
         stream.shown.components == static_cast<int>(volume.components()) &&
         (stream.slices.empty() || stream.shown.grid.voxels() == voxels);
}

}  // namespace

void subscribe(ecorche_client& client, VolumeStream& stream) {
  v1::Envelope request;
  *request.mutable_subscribe() = stream.wanted;
  const wire::Frame answer = client.connection->call(std::move(request));
  stream.subscription = answer.envelope.subscribed().subscription();
  stream.decoder = {};
}

bool take_volume(ecorche_client& client, const v1::VolumeFrame& frame, const wire::Payload& payload,
                 ecorche_event& event) {
  const auto found = std::find_if(client.volumes.begin(), client.volumes.end(), [&](const VolumeStream& one) {
    return one.subscription == frame.subscription();
  });
  if (found == client.volumes.end()) return false;
  VolumeStream& stream = *found;
  event.kind = ECORCHE_EVENT_VOLUME;
  event.stream = stream.number;
  event.sequence = frame.pose_sequence();
  if (const Status status = wire::from_proto(frame.status()); !status.ok()) {
    event.code = fail(status);
    return true;
  }
  stream.sequence.reset();  // nothing is shown where it throws
  if (const Status status = stream.decoder.decode(frame, payload, stream.shown); !status.ok())
    throw lie(status.message);
  if (!fits(stream, client.body->opened.volumes(static_cast<int>(stream.volume))))
    throw lie("a volume's frame holds another than was asked for");
  stream.sequence = frame.pose_sequence();
  return true;
}

}  // namespace ecorche::c

using namespace ecorche;

uint32_t ecorche_client_volume_count(const ecorche_client* client) {
  return client == nullptr || !client->body ? 0 : static_cast<uint32_t>(client->body->volumes.size());
}

ecorche_code ecorche_client_volume(const ecorche_client* client, uint32_t volume, ecorche_volume_info* out) {
  return c::with_client(client, true, [&] {
    const c::OpenedBody& body = *client->body;
    if (volume >= body.volumes.size()) return c::no_volume(body, volume);
    const v1::Volume& found = body.opened.volumes(static_cast<int>(volume));
    ScalarType type{};
    wire::from_proto(found.type(), type);
    ecorche_volume_info info = ECORCHE_VOLUME_INFO_INIT;
    info.name = found.name().c_str();
    info.type = static_cast<ecorche_scalar>(type);
    info.components = static_cast<int32_t>(found.components());
    info.labels = found.labels() ? 1 : 0;
    info.background = found.background();
    info.grid = c::to_c(body.volumes[volume]);
    return c::fill(out, info);
  });
}

ecorche_code ecorche_client_subscribe_volume(ecorche_client* client, uint32_t volume,
                                             const ecorche_volume_options* options, uint32_t* stream) {
  return c::with_client(client, true, [&] {
    const c::OpenedBody& body = *client->body;
    if (stream == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "stream: is null");
    if (volume >= body.volumes.size()) return c::no_volume(body, volume);
    c::VolumeStream made;
    made.volume = volume;
    c::read_options(c::read(options, ecorche_volume_options ECORCHE_VOLUME_OPTIONS_INIT),
                    body.opened.volumes(static_cast<int>(volume)).name(), made);
    c::subscribe(*client, made);
    for (const c::VolumeStream& one : client->volumes) {
      if (one.subscription != made.subscription) continue;
      *stream = one.number;
      return ECORCHE_OK;
    }
    made.number = ++client->volumes_made;
    *stream = made.number;
    client->volumes.push_back(std::move(made));
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_client_unsubscribe_volume(ecorche_client* client, uint32_t stream) {
  return c::with_client(client, true, [&] {
    const c::VolumeStream* const found = c::find(*client, stream);
    if (found == nullptr) return c::no_stream(stream);
    const std::optional<std::uint32_t> subscription = found->subscription;
    client->volumes.erase(client->volumes.begin() + (found - client->volumes.data()));
    if (!subscription) return ECORCHE_OK;
    v1::Envelope last;
    last.mutable_unsubscribe()->set_subscription(*subscription);
    client->connection->call(std::move(last));
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_client_voxels(const ecorche_client* client, uint32_t stream, uint32_t slice,
                                   ecorche_voxels* out) {
  return c::with_client(client, true, [&] {
    const c::VolumeStream* const found = c::find(*client, stream);
    if (found == nullptr) return c::no_stream(stream);
    if (!found->sequence)
      return c::fail(ECORCHE_FAILED_PRECONDITION, "stream: no frame of it has come (poll on)");
    if (slice >= std::max<std::size_t>(found->slices.size(), 1))
      return c::fail(ECORCHE_INVALID_ARGUMENT, "slice: the stream has not so many (0 without slices)");
    const Image& shown = found->shown;
    ecorche_voxels voxels = ECORCHE_VOXELS_INIT;
    voxels.sequence = *found->sequence;
    voxels.type = static_cast<ecorche_scalar>(shown.type);
    voxels.components = shown.components;
    voxels.grid = found->slices.empty() ? c::to_c(shown.grid) : found->slices[slice];
    const std::size_t voxel = scalar_bytes(shown.type) * static_cast<std::size_t>(shown.components);
    const auto bytes = [&](const ecorche_grid& grid) {
      return voxel * static_cast<std::size_t>(grid.size[0]) * static_cast<std::size_t>(grid.size[1]) *
             static_cast<std::size_t>(grid.size[2]);
    };
    std::size_t first = 0;
    for (uint32_t s = 0; s < slice; ++s) first += bytes(found->slices[s]);
    voxels.voxels = shown.bytes.data() + first;
    voxels.bytes = bytes(voxels.grid);
    return c::fill(out, voxels);
  });
}
