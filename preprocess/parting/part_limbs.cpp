// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/part_limbs.hpp"

#include <algorithm>
#include <utility>

#include "preprocess/check/touching_limbs.hpp"
#include "preprocess/parting/split_nodes.hpp"

namespace ecorche::parting {
namespace {

constexpr int kRounds = 8;  // a loose piece may fall to another

std::vector<LimbRoot> roots_of(const PartingInput& input, const std::vector<int>& limb) {
  const PointsF skin = check::outer_vertices(input.patient.skin.V.cast<float>(), input.patient.skin.F);
  std::vector<LimbRoot> out(limb.size());
  for (std::size_t s = 0; s < limb.size(); ++s) {
    if (limb[s] != static_cast<int>(s)) continue;
    out[s].joint = input.skeleton.segments[s].joint.center;
    out[s].way = check::way_to_skin(skin, out[s].joint);
  }
  return out;
}

std::array<std::int32_t, 3> nodes_of(const Tets& T, const Face& face) {
  return {node_of(T, face, 0), node_of(T, face, 1), node_of(T, face, 2)};
}

// The same face's corners on both sides: in each the order of its own tet.
std::array<std::int32_t, 3> in_order(const std::array<std::int32_t, 3>& places,
                                     const std::array<std::int32_t, 3>& nodes, const Points& V) {
  std::array<std::int32_t, 3> out{};
  for (std::size_t c = 0; c < 3; ++c) {
    for (const std::int32_t node : nodes) {
      if (V.row(node) == V.row(places[c])) out[c] = node;
    }
  }
  return out;
}

// What stays closed between parts.
std::vector<JoinedFace> joined_faces(const Tets& T, const FaceNeighbours& across, const FaceSet& open,
                                     const std::vector<std::int16_t>& parts) {
  std::vector<JoinedFace> out;
  const auto part = [&](std::int32_t t) { return parts[static_cast<std::size_t>(t)]; };
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(T.rows()); ++t) {
    for (int c = 0; c < 4; ++c) {
      const std::int32_t next = across.behind({t, c});
      if (next > t && part(next) != part(t) && !open.has({t, c}))
        out.push_back({nodes_of(T, {t, c}), part(t), part(next)});
    }
  }
  return out;
}

}  // namespace

Joined joined_limbs(const CaseContacts& contacts, const Skeleton& skeleton) {
  const std::vector<int> limb = check::limbs_of(skeleton);
  Joined out;
  for (const auto& [a, b] : contacts.joined) {
    const int first = skeleton.find_segment(a), second = skeleton.find_segment(b);
    if (first < 0 || second < 0) continue;  // it has no bones, and is not in the rig
    out.emplace_back(limb[static_cast<std::size_t>(first)], limb[static_cast<std::size_t>(second)]);
  }
  return out;
}

std::optional<Parting> part_limbs(const PartingInput& input, const Context& context) {
  const std::vector<int> limb = check::limbs_of(input.skeleton);
  const FaceNeighbours across(input.mesh.T, input.mesh.V.rows());
  const std::vector<std::uint8_t> boned = on_bones(input.mesh, across);
  const Flesh flesh{input.mesh, across, input.weights, input.bone_segment, limb, boned};
  const SolidFaces solid(input.voxels, input.patient.labels);
  Parting out;
  out.part = limb_parts(flesh, solid, context);
  const double length = (input.mesh.V.colwise().maxCoeff() - input.mesh.V.colwise().minCoeff()).maxCoeff();
  const std::vector<LimbRoot> roots = roots_of(input, limb);
  const Joined joined = joined_limbs(input.patient.contacts, input.skeleton);
  Contacts found;
  for (int round = 0; round < kRounds; ++round) {
    found = find_contacts(flesh, out.part, solid, roots, check::least_contact_mm2(length), joined);
    const bool last = round + 1 == kRounds;  // weights::attachments has what is loose even then
    if (last || !give_loose_pieces(input.mesh, across, found.faces, out.part)) break;
  }
  if (found.faces.empty()) return std::nullopt;
  const std::vector<Face>& cut = found.faces;
  TetMesh mesh = input.mesh;
  split_nodes(mesh, across, cut);

  const Eigen::Index before = input.mesh.V.rows();
  out.copied.assign(static_cast<std::size_t>(mesh.V.rows() - before), -1);
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    for (int c = 0; c < 4; ++c) {
      if (mesh.T(t, c) >= before)
        out.copied[static_cast<std::size_t>(mesh.T(t, c) - before)] = input.mesh.T(t, c);
    }
  }
  for (std::size_t f = 0; f < cut.size(); ++f) {
    OpenFace face;
    face.inner = nodes_of(mesh.T, cut[f]);
    face.outer = in_order(face.inner, nodes_of(mesh.T, across.other(cut[f])), mesh.V);
    face.contact = found.contact_of[f];
    face.solid = static_cast<float>(solid.share(corners_of(mesh, cut[f])));
    out.faces.push_back(face);
  }
  out.joined = joined_faces(mesh.T, across, FaceSet(across, cut), out.part);
  out.contacts = std::move(found.contacts);
  out.V = std::move(mesh.V);
  out.T = std::move(mesh.T);
  return out;
}

}  // namespace ecorche::parting
