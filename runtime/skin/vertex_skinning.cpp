// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/vertex_skinning.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <ecorche/kinematics/angles.hpp>
#include "runtime/skin/node_clusters.hpp"
#include "runtime/skin/skin_point.hpp"
#include "runtime/skin/vertex_groups.hpp"

namespace ecorche::runtime {
namespace {

constexpr double kSmallestFolded = 1e-4;  // as of the nodes themselves
constexpr std::array kMethods{Skinning::lbs, Skinning::dqs, Skinning::cor};
constexpr std::size_t kFew = 4;
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

Eigen::Vector3d row_of(const PointsF& points, Eigen::Index row) {
  return points.row(row).cast<double>().transpose();
}

std::array<std::uint16_t, 3> numbers(const QuantiseBox& box, const Eigen::Vector3d& at) {
  std::array<std::uint16_t, 3> out{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double number =
        (at[static_cast<Eigen::Index>(c)] - static_cast<double>(box.low[c])) / static_cast<double>(box.step);
    out[c] = static_cast<std::uint16_t>(std::lround(std::clamp(number, 0.0, 65535.0)));
  }
  return out;
}

// Weights by segment, gathered.
class Gathered {
 public:
  Gathered(const Model& model, const QuantiseBox& box)
      : model_(model), box_(box), weight_(model.segment_count(), 0.0), centre_(Eigen::Vector3d::Zero()) {}

  void clear() {
    std::fill(weight_.begin(), weight_.end(), 0.0);
    centre_.setZero();
  }

  void add_node(Eigen::Index node, double share) {
    const auto n = static_cast<std::size_t>(node);
    double sum = 0;
    for (auto e = model_.weights.offsets[n]; e < model_.weights.offsets[n + 1]; ++e)
      sum += kept(model_.weights.weight[e]);
    for (auto e = model_.weights.offsets[n]; e < model_.weights.offsets[n + 1]; ++e)
      weight_[model_.weights.segment[e]] += share * kept(model_.weights.weight[e]) / sum;
    centre_ += share * row_of(model_.cor.has_centre[n] != 0 ? model_.cor.centre : model_.nodes, node);
  }

  // Its heaviest 8.
  SkinPoint point(const Eigen::Vector3d& rest) {
    SkinPoint out;
    out.rest = numbers(box_, rest);
    out.centre = numbers(box_, centre_);
    order_.clear();
    for (std::uint16_t s = 0; s < weight_.size(); ++s) {
      if (weight_[s] >= kSmallestFolded) order_.push_back(s);
    }
    std::sort(order_.begin(), order_.end(), [this](std::uint16_t a, std::uint16_t b) {
      return weight_[a] != weight_[b] ? weight_[a] > weight_[b] : a < b;
    });
    order_.resize(std::min(order_.size(), SkinPoint::most));
    std::array<double, SkinPoint::most> shares{};
    double sum = 0;
    for (std::size_t k = 0; k < order_.size(); ++k) sum += shares[k] = weight_[order_[k]];
    for (double& share : shares) share /= sum;
    quantise_weights(std::span(shares).first(order_.size()), std::span(out.weight).first(order_.size()));
    for (std::size_t k = 0; k < order_.size(); ++k) out.segment[k] = out.weight[k] > 0 ? order_[k] : 0;
    return out;
  }

 private:
  static double kept(float weight) {
    const auto w = static_cast<double>(weight);
    return w >= kSmallestFolded ? w : 0;
  }

  const Model& model_;
  const QuantiseBox& box_;
  std::vector<double> weight_;
  Eigen::Vector3d centre_;
  std::vector<std::uint16_t> order_;
};

SkinPoint fewer(const SkinPoint& point) {
  SkinPoint out = point;
  std::array<double, kFew> shares{};
  double sum = 0;
  for (std::size_t k = 0; k < kFew; ++k) sum += shares[k] = point.weight[k];
  for (double& share : shares) share /= sum;
  quantise_weights(shares, std::span(out.weight).first(kFew));
  std::fill(out.weight.begin() + kFew, out.weight.end(), std::uint16_t{0});
  for (std::size_t k = 0; k < out.weight.size(); ++k) {
    if (out.weight[k] == 0) out.segment[k] = 0;
  }
  return out;
}

// In blocks, since a vertex is too little for a task.
template <class Each>
void for_vertices(std::size_t count, Each&& each) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 2048),
                    [&](const auto& range) { each(range.begin(), range.end()); });
}

Eigen::Vector3d position(const PosedBody& body, std::uint32_t tissue, std::size_t v) {
  const float* const at = &body.tissues[tissue][3 * v];
  return Eigen::Vector3f(at[0], at[1], at[2]).cast<double>();
}

// Every pose by every method.
template <class Each>
void for_poses(const BodyPoser& poser, std::span<const std::uint32_t> tissues, std::span<const Pose> poses,
               PosedBody& body, const QuantiseBox& box, Each&& each) {
  for (const Pose& pose : poses) {
    for (const Skinning method : kMethods) {
      if (!poser.run(pose, method, tissues, body, NodesOf::tissues, Root::still).ok()) continue;
      each(PointSkinner(body.segments, method, box));
    }
  }
}

// What is known of a tissue before it is decided what its vertices hang on.
struct Candidate {
  std::vector<float> few, many;  // largest errors
};

TissueSkinning candidates(const Model& model, std::uint32_t t, const QuantiseBox& box) {
  const Tissue& tissue = model.tissues[t];
  TissueSkinning out;
  out.tissue = t;
  out.vertices.resize(static_cast<std::size_t>(tissue.V.rows()));
  for_vertices(out.vertices.size(), [&](std::size_t begin, std::size_t end) {
    Gathered gathered(model, box);
    for (std::size_t v = begin; v < end; ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      const Eigen::Vector3d rest = row_of(tissue.V, row);
      if (tissue.segment != Tissue::by_tets) {
        out.vertices[v].rest = out.vertices[v].centre = numbers(box, rest);
        out.vertices[v].segment[0] = static_cast<std::uint16_t>(tissue.segment);
        out.vertices[v].weight[0] = 65535;
        continue;
      }
      gathered.clear();
      for (int k = 0; k < 4; ++k)
        gathered.add_node(model.tets(tissue.tet[v], k), static_cast<double>(tissue.barycentric(row, k)));
      out.vertices[v] = gathered.point(rest);
    }
  });
  return out;
}

void measure(const PointSkinner& skinner, const PosedBody& body, const TissueSkinning& tissue,
             Candidate& errors) {
  for_vertices(tissue.vertices.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const SkinPoint& point = tissue.vertices[v];
      const Eigen::Vector3d true_place = position(body, tissue.tissue, v);
      const auto off = [&](const SkinPoint& p) {
        return static_cast<float>((skinner.place(p).at - true_place).norm());
      };
      errors.many[v] = std::max(errors.many[v], off(point));
      // NaN, of weights that are no numbers, hangs a vertex on its nodes.
      errors.few[v] = point.weight[kFew] == 0 ? errors.many[v] : std::max(errors.few[v], off(fewer(point)));
    }
  });
}

void hang(const Model& model, const QuantiseBox& box, const std::vector<std::uint32_t>& vertices,
          TissueSkinning& out) {
  const Tissue& tissue = model.tissues[out.tissue];
  std::vector<std::uint32_t> needed;
  for (const std::uint32_t v : vertices) {
    for (int k = 0; k < 4; ++k) needed.push_back(static_cast<std::uint32_t>(model.tets(tissue.tet[v], k)));
  }
  std::sort(needed.begin(), needed.end());
  needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
  Gathered gathered(model, box);
  for (const std::uint32_t node : needed) {
    gathered.clear();
    gathered.add_node(static_cast<Eigen::Index>(node), 1);
    out.nodes.push_back(gathered.point(row_of(model.nodes, static_cast<Eigen::Index>(node))));
  }
  for (const std::uint32_t v : vertices) {
    HungVertex& hung = out.hung.emplace_back();
    hung.vertex = v;
    for (int k = 0; k < 4; ++k) {
      const auto c = static_cast<std::size_t>(k);
      const auto node = static_cast<std::uint32_t>(model.tets(tissue.tet[v], k));
      hung.node[c] =
          static_cast<std::uint32_t>(std::lower_bound(needed.begin(), needed.end(), node) - needed.begin());
      hung.share[c] = tissue.barycentric(static_cast<Eigen::Index>(v), k);
    }
    // Never skinned itself: what is 0 takes no room.
    const std::array<std::uint16_t, 3> rest = out.vertices[v].rest;
    out.vertices[v] = {};
    out.vertices[v].rest = rest;
  }
}

void decide(const Model& model, const QuantiseBox& box, const Candidate& errors, TissueSkinning& out) {
  if (model.tissues[out.tissue].segment != Tissue::by_tets) return;
  out.influences = kFew;
  std::vector<std::uint32_t> hung;
  for (std::uint32_t v = 0; v < out.vertices.size(); ++v) {
    SkinPoint& point = out.vertices[v];
    if (point.weight[kFew] == 0 ? errors.many[v] <= fold_error_mm : errors.few[v] <= fold_error_mm) {
      if (point.weight[kFew] != 0) point = fewer(point);
    } else if (errors.many[v] <= fold_error_mm) {
      out.influences = SkinPoint::most;
    } else {
      hung.push_back(v);
    }
  }
  hang(model, box, hung, out);
  for (const SkinPoint& node : out.nodes) {
    if (node.weight[kFew] != 0) out.influences = SkinPoint::most;
  }
}

double turn_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// What is left over of the tissue in one pose: the largest distance, and every normal's turn.
void measure_left(const PointSkinner& skinner, const PosedBody& body, const TissueSkinning& tissue,
                  const PointsF& normals, double& largest, std::vector<float>& turns) {
  std::vector<std::uint32_t> row(tissue.vertices.size(), kNone);
  for (std::uint32_t h = 0; h < tissue.hung.size(); ++h) row[tissue.hung[h].vertex] = h;
  std::vector<float> apart(tissue.vertices.size());
  const std::size_t first = turns.size();
  turns.resize(first + tissue.vertices.size());
  for_vertices(tissue.vertices.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const Eigen::Vector3d normal = row_of(normals, static_cast<Eigen::Index>(v));
      const SkinnedPoint skinned = row[v] == kNone ? skinner.place(tissue.vertices[v], normal)
                                                   : skinner.place(tissue.hung[row[v]], tissue.nodes, normal);
      apart[v] = static_cast<float>((skinned.at - position(body, tissue.tissue, v)).norm());
      const std::int16_t* const n = &body.normals[tissue.tissue][3 * v];
      const Eigen::Vector3d true_normal(n[0], n[1], n[2]);
      turns[first + v] =
          true_normal.isZero() ? 0 : static_cast<float>(turn_between(skinned.normal, true_normal));
    }
  });
  for (const float a : apart) largest = std::max(largest, static_cast<double>(a));
}

}  // namespace

QuantiseBox skinning_box(const Model& model) {
  Eigen::RowVector3f low = model.nodes.colwise().minCoeff(), high = model.nodes.colwise().maxCoeff();
  for (const Tissue& tissue : model.tissues) {
    if (tissue.V.rows() == 0) continue;
    low = low.cwiseMin(tissue.V.colwise().minCoeff());
    high = high.cwiseMax(tissue.V.colwise().maxCoeff());
  }
  return {{low[0], low[1], low[2]}, std::max((high - low).maxCoeff(), 1.0F) / 65535};
}

std::vector<TissueSkinning> fold_to_vertices(const BodyPoser& poser, std::span<const std::uint32_t> tissues,
                                             std::span<const Pose> poses, SkinningError& error) {
  const Model& model = poser.model();
  const QuantiseBox box = skinning_box(model);
  std::vector<TissueSkinning> out;
  std::vector<Candidate> errors;
  std::vector<PointsF> normals;
  PosedBody body = poser.make_frame({.positions = false});
  for (const std::uint32_t t : tissues) {
    out.push_back(candidates(model, t, box));
    errors.emplace_back().few.assign(out.back().vertices.size(), 0);
    errors.back().many = errors.back().few;
    normals.push_back(rest_normals(model.tissues[t]));
    body.tissues[t].resize(3 * out.back().vertices.size());
  }
  for_poses(poser, tissues, poses, body, box, [&](const PointSkinner& skinner) {
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (model.tissues[out[i].tissue].segment == Tissue::by_tets) measure(skinner, body, out[i], errors[i]);
    }
  });
  for (std::size_t i = 0; i < out.size(); ++i) decide(model, box, errors[i], out[i]);
  errors.clear();
  for (const std::uint32_t t : tissues) body.normals[t].resize(body.tissues[t].size());
  std::vector<float> turns;
  for_poses(poser, tissues, poses, body, box, [&](const PointSkinner& skinner) {
    turns.clear();
    for (std::size_t i = 0; i < out.size(); ++i)
      measure_left(skinner, body, out[i], normals[i], error.largest_mm, turns);
    if (turns.empty()) return;
    const auto usual = turns.begin() + static_cast<std::ptrdiff_t>(turns.size() * 99 / 100);
    std::nth_element(turns.begin(), usual, turns.end());
    error.usual_turn = std::max(error.usual_turn, static_cast<double>(*usual));
    error.largest_turn =
        std::max(error.largest_turn, static_cast<double>(*std::max_element(usual, turns.end())));
  });
  return out;
}

std::vector<Pose> halfway_poses(const Skeleton& skeleton) {
  constexpr double unlimited = 1;  // radians
  std::vector<Pose> poses;
  for (const double side : {-1.0, 1.0}) {
    Pose pose = Pose::rest(skeleton.segments.size());
    for (std::size_t s = 1; s < skeleton.segments.size(); ++s) {
      const Joint& joint = skeleton.segments[s].joint;
      if (joint.sequence.size() != 3) continue;
      std::array<double, 3> angles{};
      for (std::size_t a = 0; a < 3; ++a) {
        const AngleAxis& axis = joint.sequence[a];
        const double limit = side < 0 ? axis.min : axis.max;
        angles[a] = axis.rest + (std::isfinite(limit) ? limit - axis.rest : side * unlimited) / 2;
      }
      pose.rotation[s] = kinematics::rotation_from_angles(joint, angles);
    }
    poses.push_back(std::move(pose));
  }
  return poses;
}

}  // namespace ecorche::runtime
