// SPDX-License-Identifier: Apache-2.0
#include "phantom/body.hpp"

#include <algorithm>

#include <ecorche/values/error.hpp>

namespace ecorche::phantom {

namespace {

/// Mirror images keep pointing at their originals.
void append(std::vector<Part>& to, const std::vector<Part>& from) {
  const int offset = static_cast<int>(to.size());
  for (Part part : from) {
    if (part.mirror_of >= 0) part.mirror_of += offset;
    to.push_back(std::move(part));
  }
}

/// What is the mirror image of it stands for itself then.
void leave_out(std::vector<Part>& parts, const std::string& name) {
  const auto found = std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == name; });
  if (found == parts.end()) throw Error(ErrorKind::internal, "phantom", "no part " + name, "report it");
  const int row = static_cast<int>(found - parts.begin());
  parts.erase(found);
  for (Part& part : parts) {
    if (part.mirror_of == row)
      part.mirror_of = -1;
    else if (part.mirror_of > row)
      --part.mirror_of;
  }
}

}  // namespace

void add_pair(std::vector<Part>& parts, Part part) {
  const std::string name = part.name, segment = part.segment;
  const int left = static_cast<int>(parts.size());
  part.name = name + "_left";
  if (!segment.empty()) part.segment = segment + "_left";
  parts.push_back(part);
  part.name = name + "_right";
  if (!segment.empty()) part.segment = segment + "_right";
  part.shape = mirrored(part.shape);
  part.mirror_of = left;
  parts.push_back(part);
}

const Part& find_part(const std::vector<Part>& parts, std::string_view name) {
  for (const Part& part : parts) {
    if (part.name == name) return part;
  }
  throw Error(ErrorKind::internal, "phantom", "no part " + std::string(name), "report it");
}

Body make_body(const Proportions& of) {
  Body body;
  body.at = make_landmarks(of);
  const std::vector<Part> bones = make_bones(body.at);
  const std::vector<Part> vessels = make_vessels(body.at);
  const std::vector<Part> organs = make_organs(body.at, bones, vessels);
  std::vector<Part> neighbours = organs;
  append(neighbours, vessels);
  const std::vector<Part> muscles =
      make_muscles(body.at, find_part(bones, "scapula_left").shape, make_keepout(body.at, bones), neighbours);
  body.skin = make_skin(body.at, bones, muscles, vessels);
  append(body.parts, muscles);
  append(body.parts, neighbours);
  append(body.parts, bones);
  for (const std::string& name : of.missing) leave_out(body.parts, name);
  return body;
}

}  // namespace ecorche::phantom
