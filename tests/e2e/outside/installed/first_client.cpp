// SPDX-License-Identifier: Apache-2.0
// first_client HOST:PORT FILE.obj: bends a knee on a server, and writes the skin that comes back.
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ecorche/client/client.hpp>
#include <ecorche/wire/mesh_decoder.hpp>
#include <fstream>
#include <span>
#include <vector>

namespace {

using namespace ecorche;

void write_obj(const char* file, const wire::DecodedTissue& skin, std::span<const std::uint32_t> corners) {
  std::ofstream out(file);
  const std::vector<float>& p = skin.positions;
  for (std::size_t v = 0; v < p.size(); v += 3)
    out << "v " << p[v] << ' ' << p[v + 1] << ' ' << p[v + 2] << '\n';
  for (std::size_t c = 0; c < corners.size(); c += 3)
    out << "f " << corners[c] + 1 << ' ' << corners[c + 1] + 1 << ' ' << corners[c + 2] + 1 << '\n';
}

}  // namespace

int main(int, char** argv) try {
  client::Client client(wire::parse_address(argv[1]), "first client");

  // The server's first model, in a session of our own. The answer's payload holds the triangles.
  v1::Envelope open;
  open.mutable_open_model();
  const wire::Frame opened = client.call(open);
  const v1::ModelOpened& body = opened.envelope.model_opened();
  const v1::Array& array = body.tissues(0).triangles();  // of the skin, which comes first
  const std::size_t size = opened.payload.size(), row = 3 * sizeof(std::uint32_t);
  if (array.count() > size / row || array.offset() > size - array.count() * row)
    throw Error(ErrorKind::protocol, "triangles", "reach beyond their payload", "report it");
  std::vector<std::uint32_t> corners(3 * array.count());
  std::memcpy(corners.data(), opened.payload.data() + array.offset(), array.count() * row);

  v1::Envelope subscribe;
  subscribe.mutable_subscribe()->mutable_mesh()->add_tissues(body.tissues(0).name());
  client.call(subscribe);

  // A whole pose: one rotation (w, x, y, z) for each joint, counted from the scan.
  v1::Envelope envelope;
  v1::PoseUpdate& pose = *envelope.mutable_pose_update();
  pose.set_sequence(1);
  pose.set_rig_digest(body.rig_digest());
  pose.mutable_root_translation();
  pose.set_skinning(v1::SKINNING_COR);
  for (const v1::Segment& segment : body.skeleton().segments()) {
    const double angle = segment.joint().name() == "knee_right" ? 1.0 : 0.0;  // radians, about the joint's x
    for (const double q : {std::cos(angle / 2), std::sin(angle / 2), 0.0, 0.0}) pose.add_rotation(q);
  }
  client.send(envelope);

  // Frames and acknowledgements come as they are ready. The first frame may still show the scan.
  wire::MeshDecoder decoder;
  std::vector<wire::DecodedTissue> tissues;
  const auto until = client::Clock::now() + std::chrono::seconds(10);
  while (const auto message = client.receive(until)) {
    if (!message->envelope.has_mesh_frame()) continue;
    const v1::MeshFrame& frame = message->envelope.mesh_frame();
    const Status status = decoder.decode(frame, message->payload, tissues);
    if (!status.ok()) throw Error(ErrorKind::protocol, "frame", status.message, "report it");
    if (frame.pose_sequence() < 1) continue;
    write_obj(argv[2], tissues.at(0), corners);
    std::printf("pose 1: %zu vertices\n", tissues.at(0).positions.size() / 3);
    return 0;
  }
  std::fprintf(stderr, "error: no frame within 10 seconds\n");
  return 1;
} catch (const ecorche::Error& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 1;
}
