// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/contact_faces.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "preprocess/check/touching_limbs.hpp"

namespace ecorche::parting {
namespace {

using Eigen::Vector3d;

// From the joint, in ways from there to the skin. Of ICRP's woman 1.75 tells contact from flesh that hangs on
// the joint with precision 0.90 and recall 0.92; of a body that stands free nothing reaches kSure.
constexpr double kContact = 1.75;
constexpr double kSure = check::sure_ways, kSureOfTwo = check::sure_ways_of_two;
constexpr int kFlattenings = 3;
constexpr double kBetweenLimbs = 0.9,
                 kMost = 0.97;  // confidence: at most as often as skin deep in a body is contact

struct Seen {
  Face face;
  double area = 0;  // mm2 in the body, seen along the contact: faces of tets zigzag about it
  Vector3d across = Vector3d::Zero();  // normal, as long as the area in the body
  double ratio = 0;                    // from the joint in ways to the skin; of two limbs the larger
  Vector3d middle = Vector3d::Zero();
};
using Pair = std::pair<int, int>;  // uppermost segments, the limb first; the rest of the body is -1

class Finder {
 public:
  Finder(const Flesh& flesh, const std::vector<std::int16_t>& part, const std::vector<LimbRoot>& roots)
      : flesh_(flesh), part_(part), roots_(roots) {}

  std::map<Pair, std::vector<Seen>> seen(const SolidFaces& solid) const {
    std::map<Pair, std::vector<Seen>> out;
    for (std::int32_t t = 0; t < static_cast<std::int32_t>(part_.size()); ++t) {
      for (int c = 0; c < 4; ++c) {
        const std::int32_t next = flesh_.across.behind({t, c});
        if (next < 0 || !comes_first(part(t), part(next)) || flesh_.boned[static_cast<std::size_t>(t)] == 0)
          continue;
        const Seen one = look({t, c}, part(next), solid);
        if (part(next) >= 0 || one.ratio > kContact) out[{part(t), part(next)}].push_back(one);
      }
    }
    for (auto& [pair, faces] : out) flatten(faces);
    return out;
  }

  Contact contact(const Pair& pair, const std::vector<Seen>& faces) const {
    Contact out;
    out.limb = pair.first;
    out.other_limb = pair.second;
    Vector3d middle = Vector3d::Zero();
    std::map<int, double> own, other;  // mm2 by segment
    double sure = 0, weight = 0;
    for (const Seen& one : faces) {
      const double area = std::max(one.area, 1e-9);  // also of what is only bridged
      weight += area;
      out.area_mm2 += one.area;
      middle += area * one.middle;
      const double far = std::clamp((one.ratio - kContact) / (kSure - kContact), 0.0, 1.0);
      sure += area * std::max(0.5 + (kMost - 0.5) * far, pair.second >= 0 ? kBetweenLimbs : 0.0);
      count_segments(one, area, pair, own, other);
    }
    middle /= weight;
    out.confidence = sure / weight;
    out.own = most(own);
    out.other = most(other);
    double least = std::numeric_limits<double>::infinity();
    for (const Seen& one : faces) {
      const double d = (one.middle - middle).squaredNorm();
      if (d >= least) continue;
      least = d;
      out.at = one.middle;
    }
    return out;
  }

 private:
  int part(std::int32_t tet) const { return part_[static_cast<std::size_t>(tet)]; }
  static bool comes_first(int a, int b) { return a >= 0 && (b < 0 || a < b); }

  double ratio(const Vector3d& at, int limb) const {
    const LimbRoot& root = roots_[static_cast<std::size_t>(limb)];
    return (at - root.joint).norm() / root.way;
  }

  Seen look(const Face& face, int other, const SolidFaces& solid) const {
    const std::array<Vector3d, 3> p = corners_of(flesh_.mesh, face);
    Seen out;
    out.face = face;
    out.middle = (p[0] + p[1] + p[2]) / 3;
    out.ratio = ratio(out.middle, part(face.tet));
    if (other >= 0) out.ratio = std::max(out.ratio, ratio(out.middle, other));
    out.across = 0.5 * (p[1] - p[0]).cross(p[2] - p[0]) * solid.share(p);
    return out;
  }

  // What of each face's area is seen along the contact's normal there: the mean over the faces about.
  void flatten(std::vector<Seen>& faces) const {
    const auto corner = [&](const Seen& one, int c) { return node_of(flesh_.mesh.T, one.face, c); };
    std::vector<Vector3d> mean(faces.size());
    for (std::size_t f = 0; f < faces.size(); ++f) mean[f] = faces[f].across;
    for (int pass = 0; pass < kFlattenings; ++pass) {
      std::map<std::int32_t, Vector3d> normal;  // of nodes
      for (std::size_t f = 0; f < faces.size(); ++f) {
        for (int c = 0; c < 3; ++c)
          normal.try_emplace(corner(faces[f], c), Vector3d::Zero()).first->second += mean[f];
      }
      for (std::size_t f = 0; f < faces.size(); ++f) {
        mean[f].setZero();
        for (int c = 0; c < 3; ++c) mean[f] += normal.at(corner(faces[f], c));
      }
    }
    for (std::size_t f = 0; f < faces.size(); ++f)
      faces[f].area = std::max(0.0, faces[f].across.dot(mean[f].stableNormalized()));
  }

  void count_segments(const Seen& one, double area, const Pair& pair, std::map<int, double>& own,
                      std::map<int, double>& other) const {
    const Weights& w = flesh_.weights;
    for (int c = 0; c < 3; ++c) {
      const auto node = static_cast<std::size_t>(node_of(flesh_.mesh.T, one.face, c));
      for (std::uint64_t i = w.offsets[node]; i < w.offsets[node + 1]; ++i) {
        const int segment = static_cast<int>(w.segment[i]), limb = flesh_.limb[w.segment[i]];
        if (limb == pair.first) own[segment] += area * w.weight[i];
        if (limb == pair.second) other[segment] += area * w.weight[i];
      }
    }
  }

  static int most(const std::map<int, double>& areas) {
    const auto found = std::max_element(areas.begin(), areas.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
    return found == areas.end() ? -1 : found->first;
  }

  const Flesh& flesh_;
  const std::vector<std::int16_t>& part_;
  const std::vector<LimbRoot>& roots_;
};

double sure_area(const Pair& pair, const std::vector<Seen>& faces) {
  double out = 0;
  for (const Seen& one : faces) out += one.ratio > (pair.second < 0 ? kSure : kSureOfTwo) ? one.area : 0;
  return out;
}

}  // namespace

Contacts find_contacts(const Flesh& flesh, const std::vector<std::int16_t>& part, const SolidFaces& solid,
                       const std::vector<LimbRoot>& roots, double least_mm2, const Joined& joined) {
  const Finder finder(flesh, part, roots);
  std::map<Pair, std::vector<Seen>> pairs = finder.seen(solid);
  for (const auto& [a, b] : joined) {
    pairs.erase({a, b});
    pairs.erase({b, a});
  }
  std::set<int> cut;  // limbs
  for (const auto& [pair, faces] : pairs) {
    if (sure_area(pair, faces) >= least_mm2) cut.insert({pair.first, pair.second});
  }
  cut.erase(-1);
  Contacts out;
  for (auto& [pair, faces] : pairs) {
    if (sure_area(pair, faces) < least_mm2) {
      if (cut.count(pair.first) == 0 && cut.count(pair.second) == 0) continue;
      std::erase_if(faces, [](const Seen& one) { return one.ratio <= kSure; });
      if (faces.empty()) continue;
    }
    const Contact contact = finder.contact(pair, faces);
    if (contact.own < 0 || contact.other < 0) continue;  // no bone moves the one or the other there
    for (const Seen& one : faces) {
      out.faces.push_back(one.face);
      out.contact_of.push_back(static_cast<std::int32_t>(out.contacts.size()));
    }
    out.contacts.push_back(contact);
  }
  return out;
}

}  // namespace ecorche::parting
