// SPDX-License-Identifier: Apache-2.0
#include "runtime/settle/unfold.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <ecorche/runtime/pose_quality.hpp>
#include "runtime/settle/fold_energy.hpp"
#include "runtime/settle/lbfgs.hpp"
#include "runtime/settle/patch_volumes.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

constexpr int kRings[] = {2, 4, 7};  ///< of nodes about the folds, pass by pass
constexpr int kRounds = 12;          ///< of a pass: eps is lowered between them
constexpr int kSteps = 40;           ///< of a round
constexpr double kEnough = 0.02;     ///< det F that a patch is left with
constexpr double kLeastEps = 1e-3;
constexpr double kTie = 0.1;         ///< of a node to where skinning put it, against the shapes of mean tets
constexpr double kTolerance = 1e-3;  ///< of a tissue's rest volume, by which it may come out farther from it
constexpr double kAimed = 0.3;       ///< of the tolerance: what patches are held to
constexpr int kMoreRounds = 8;       ///< for volumes alone

Vector3d rest_of(const Model& model, std::int32_t node) {
  return model.nodes.row(node).cast<double>().transpose();
}

/// Nodes that touch a bone: 1.
std::vector<std::uint8_t> held_nodes(const Model& model) {
  std::vector<std::uint8_t> held(model.node_count(), 0);
  for (std::size_t t = 0; t < model.tet_count(); ++t) {
    if (model.tet_label[t] == TetMesh::soft) continue;
    for (int c = 0; c < 4; ++c)
      held[static_cast<std::size_t>(model.tets(static_cast<Eigen::Index>(t), c))] = 1;
  }
  return held;
}

/// Tets with zero volume or less, and what they hold at rest.
struct Inverted {
  std::vector<std::size_t> tets;
  double rest_mm3 = 0;
};

Inverted inverted(const Model& model, std::span<const float> nodes) {
  const std::vector<float> det_f = tet_det_f(model, nodes);
  Inverted out;
  for (std::size_t t = 0; t < det_f.size(); ++t) {
    if (det_f[t] > 0) continue;
    out.tets.push_back(t);
    const auto corner = [&](int c) { return model.nodes.row(model.tets(static_cast<Eigen::Index>(t), c)); };
    out.rest_mm3 += tet_det(corner(0), corner(1), corner(2), corner(3)) / 6;
  }
  return out;
}

/// Connected groups of free nodes with their tets: each relaxes on its own.
class Patches {
 public:
  /// The free nodes within `rings` edges of the tets `seeds`, and every tet at one of them that is not
  /// `given_up`.
  Patches(const Model& model, const std::vector<std::uint8_t>& held,
          const std::vector<std::uint8_t>& given_up, const std::vector<std::size_t>& seeds, int rings,
          std::span<const float> nodes)
      : model_(model), group_(model.node_count(), kOutside), row_(model.node_count(), -1) {
    mark(held, seeds, rings);
    std::vector<std::vector<std::size_t>> tets = group(given_up);
    patches_.resize(tets.size());
    nodes_.resize(tets.size());
    for (std::size_t g = 0; g < tets.size(); ++g) fill(g, tets[g], nodes);
  }

  std::size_t count() const { return patches_.size(); }
  const FoldPatch& operator[](std::size_t g) const { return patches_[g]; }

  /// Per node of the body its place among the free ones of patch `g`, -1 elsewhere.
  std::vector<std::int32_t> free_of(std::size_t g) const {
    std::vector<std::int32_t> out(model_.node_count(), -1);
    for (std::size_t i = 0; i < patches_[g].free; ++i) out[nodes_[g][i]] = static_cast<std::int32_t>(i);
    return out;
  }
  /// Tets a mm^3 of rest.
  double density(std::size_t g) const { return density_[g]; }
  /// What `write` wrote, taken back.
  void restore(std::size_t g, std::span<const float> before, std::span<float> nodes) const {
    for (std::size_t i = 0; i < patches_[g].free; ++i)
      std::copy_n(&before[3 * nodes_[g][i]], 3, &nodes[3 * nodes_[g][i]]);
  }

  void write(std::size_t g, const Eigen::VectorXd& x, std::span<float> nodes) const {
    for (std::size_t i = 0; i < patches_[g].free; ++i)
      for (std::size_t c = 0; c < 3; ++c)
        nodes[3 * nodes_[g][i] + c] = static_cast<float>(x[static_cast<Eigen::Index>(3 * i + c)]);
  }

 private:
  static constexpr std::int32_t kOutside = -1, kFree = -2;

  std::size_t at(std::size_t t, int c) const {
    return static_cast<std::size_t>(model_.tets(static_cast<Eigen::Index>(t), c));
  }

  template <class F>
  bool any_corner(std::size_t t, F f) const {
    return f(at(t, 0)) || f(at(t, 1)) || f(at(t, 2)) || f(at(t, 3));
  }

  void mark(const std::vector<std::uint8_t>& held, const std::vector<std::size_t>& seeds, int rings) {
    std::vector<std::uint8_t> near(model_.node_count(), 0);
    const auto take = [&](std::size_t t) {
      for (int c = 0; c < 4; ++c) near[at(t, c)] = 1;
    };
    for (const std::size_t t : seeds) take(t);
    for (int ring = 0; ring < rings; ++ring) {
      const std::vector<std::uint8_t> before = near;
      for (std::size_t t = 0; t < model_.tet_count(); ++t)
        if (any_corner(t, [&](std::size_t n) { return before[n] != 0; })) take(t);
    }
    for (std::size_t n = 0; n < near.size(); ++n)
      if (near[n] && !held[n]) group_[n] = kFree;
  }

  /// Numbers the groups by their lowest tets; returns the tets of each.
  std::vector<std::vector<std::size_t>> group(const std::vector<std::uint8_t>& given_up) {
    std::vector<std::int32_t> root(model_.node_count());
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](std::size_t n) {
      while (static_cast<std::size_t>(root[n]) != n)
        n = static_cast<std::size_t>(root[n] = root[static_cast<std::size_t>(root[n])]);
      return n;
    };
    std::vector<std::size_t> tets;
    for (std::size_t t = 0; t < model_.tet_count(); ++t) {
      if (given_up[t] || !any_corner(t, [&](std::size_t n) { return group_[n] == kFree; })) continue;
      tets.push_back(t);
      std::size_t first = model_.node_count();
      for (int c = 0; c < 4; ++c) {
        if (group_[at(t, c)] != kFree) continue;
        if (first == model_.node_count()) first = find(at(t, c));
        root[find(at(t, c))] = static_cast<std::int32_t>(first);
      }
    }
    std::vector<std::vector<std::size_t>> out;
    std::vector<std::int32_t> number(model_.node_count(), -1);
    for (const std::size_t t : tets) {
      std::size_t free = 0;
      for (int c = 0; c < 4; ++c)
        if (group_[at(t, c)] != kOutside) free = at(t, c);
      std::int32_t& g = number[find(free)];
      if (g < 0) {
        g = static_cast<std::int32_t>(out.size());
        out.emplace_back();
      }
      out[static_cast<std::size_t>(g)].push_back(t);
    }
    return out;
  }

  void fill(std::size_t g, const std::vector<std::size_t>& tets, std::span<const float> nodes) {
    FoldPatch& patch = patches_[g];
    const auto add = [&](std::size_t n) {
      if (row_[n] >= 0) return;
      row_[n] = static_cast<std::int32_t>(nodes_[g].size());
      nodes_[g].push_back(n);
      for (std::size_t c = 0; c < 3; ++c) patch.x.push_back(static_cast<double>(nodes[3 * n + c]));
    };
    for (const std::size_t t : tets)
      for (int c = 0; c < 4; ++c)
        if (group_[at(t, c)] != kOutside) add(at(t, c));
    patch.free = nodes_[g].size();
    double volume = 0;
    for (const std::size_t t : tets) {
      for (int c = 0; c < 4; ++c) add(at(t, c));
      patch.tets.push_back(tet_of(t));
      volume += patch.tets.back().weight;
    }
    for (FoldPatch::Tet& tet : patch.tets) tet.weight *= static_cast<double>(tets.size()) / volume;
    density_.push_back(6 * static_cast<double>(tets.size()) / volume);
    for (const std::size_t n : nodes_[g]) row_[n] = -1;  // held nodes may lie in several groups
  }

  FoldPatch::Tet tet_of(std::size_t t) const {
    FoldPatch::Tet tet;
    std::array<Vector3d, 4> p;
    for (int c = 0; c < 4; ++c) {
      tet.node[static_cast<std::size_t>(c)] = row_[at(t, c)];
      p[static_cast<std::size_t>(c)] = rest_of(model_, model_.tets(static_cast<Eigen::Index>(t), c));
    }
    Eigen::Matrix3d edges;
    edges << p[1] - p[0], p[2] - p[0], p[3] - p[0];
    const Eigen::Matrix3d gradients = edges.inverse();
    Eigen::Map<Vector3d>(tet.gradient[0].data()) = -gradients.colwise().sum().transpose();
    for (std::size_t c = 0; c < 3; ++c)
      Eigen::Map<Vector3d>(tet.gradient[c + 1].data()) =
          gradients.row(static_cast<Eigen::Index>(c)).transpose();
    tet.weight = edges.determinant();
    return tet;
  }

  const Model& model_;
  std::vector<std::int32_t> group_;  // of every node of the body: kFree, or kOutside the patches
  std::vector<std::int32_t> row_;    // of every node, in the patch that is being filled
  std::vector<FoldPatch> patches_;
  std::vector<std::vector<std::size_t>> nodes_;  // of every row, free ones first
  std::vector<double> density_;                  // of every patch
};

/// Returns the free nodes, relaxed until no tet is flat or nothing gets better; each is tied to where
/// skinning had put it, and tissues are held to the bounds of their volumes.
Eigen::VectorXd relax(const FoldPatch& patch, PatchVolumes& volumes, double length, const Context& context) {
  const FoldEnergy energy(patch);
  std::vector<double> all = patch.x;
  const auto free = static_cast<Eigen::Index>(3 * patch.free);
  const Eigen::VectorXd start = Eigen::Map<const Eigen::VectorXd>(patch.x.data(), free);
  const double tie = kTie / (length * length);
  Eigen::VectorXd x = start;
  const auto placed = [&](const Eigen::VectorXd& y) -> std::span<const double> {
    std::copy(y.begin(), y.end(), all.begin());
    return all;
  };
  double beyond = 0;  // the volumes' bounds, of a rest volume
  const auto round = [&](double eps) {
    lbfgs(
        [&](const Eigen::VectorXd& y, Eigen::VectorXd& gradient) {
          context.check_stop();
          const double sum = energy(placed(y), eps, {gradient.data(), static_cast<std::size_t>(free)});
          gradient += tie * (y - start);
          return sum + tie / 2 * (y - start).squaredNorm() + volumes(y, gradient);
        },
        x, kSteps, 0.1 * length);
    beyond = volumes.tighten(x);
    return energy.folds(placed(x));
  };
  FoldEnergy::Folds best = energy.folds(placed(x));
  const auto eps_of = [](double least) {
    return std::sqrt(kLeastEps * kLeastEps + 0.04 * std::pow(std::min(0.0, least), 2));
  };
  for (int n = 0, idle = 0; n < kRounds && best.least < kEnough && idle < 2; ++n) {
    const FoldEnergy::Folds now = round(eps_of(best.least));
    idle = now.count < best.count || now.least > best.least + 0.01 ? 0 : idle + 1;
    best = now;
  }
  if (best.count == 0) best = round(kLeastEps);  // eps shrank before the shapes had settled
  for (int n = 0; n < kMoreRounds && beyond > kAimed * kTolerance; ++n) best = round(eps_of(best.least));
  return x;
}

/// Vertices that hang on tets with a moved node, again where their tets are.
void carry_tissues(const Model& model, const std::vector<std::uint8_t>& moved, PosedBody& body) {
  for (std::size_t i = 0; i < model.tissues.size(); ++i) {
    const Tissue& tissue = model.tissues[i];
    if (tissue.segment != Tissue::by_tets) continue;
    for (std::size_t v = 0; v < tissue.tet.size(); ++v) {
      const auto tet = model.tets.row(tissue.tet[v]);
      if (!std::any_of(tet.begin(), tet.end(),
                       [&](std::int32_t n) { return moved[static_cast<std::size_t>(n)] != 0; }))
        continue;
      for (std::size_t c = 0; c < 3; ++c) {
        double p = 0;
        for (int k = 0; k < 4; ++k)
          p += static_cast<double>(tissue.barycentric(static_cast<Eigen::Index>(v), k)) *
               static_cast<double>(body.nodes[3 * static_cast<std::size_t>(tet[k]) + c]);
        body.tissues[i][3 * v + c] = static_cast<float>(p);
      }
    }
  }
}

class Unfolder {
 public:
  Unfolder(const Model& model, std::span<const float> skinned, const Context& context)
      : model_(model),
        context_(context),
        held_(held_nodes(model)),
        given_up_(model.tet_count(), 0),
        volumes_(model, skinned, kAimed * kTolerance) {}

  bool on_bones(std::size_t t) const {
    const auto tet = model_.tets.row(static_cast<Eigen::Index>(t));
    return std::all_of(tet.begin(), tet.end(),
                       [&](std::int32_t n) { return held_[static_cast<std::size_t>(n)] != 0; });
  }

  /// Patches about the folds, narrow ones first. Returns what is left inverted.
  Inverted run(std::vector<float>& nodes) const {
    Inverted now = inverted(model_, nodes);
    for (const int rings : kRings) {
      const std::vector<std::size_t> seeds = hopeful(now);
      if (seeds.empty()) break;
      const Patches patches(model_, held_, given_up_, seeds, rings, nodes);
      const double length = std::cbrt(6 * now.rest_mm3 / static_cast<double>(now.tets.size()));
      std::vector<PatchVolumes> parts = parts_of(patches, nodes);
      std::vector<float> next = nodes;
      tbb::parallel_for(std::size_t{0}, patches.count(), [&](std::size_t g) {
        patches.write(g, relax(patches[g], parts[g], length, context_), next);
      });
      step_back(patches, parts, nodes, next);
      Inverted after = inverted(model_, next);
      if (after.rest_mm3 >= now.rest_mm3 || after.tets.size() > now.tets.size()) continue;
      nodes.swap(next);
      now = std::move(after);
    }
    return now;
  }

  /// What is still inverted is no longer asked for: returns whether there is any.
  bool give_up(const Inverted& left) {
    const std::vector<std::size_t> hopeless = hopeful(left);
    for (const std::size_t t : hopeless) given_up_[t] = 1;
    return !hopeless.empty();
  }

 private:
  std::vector<std::size_t> hopeful(const Inverted& folds) const {
    std::vector<std::size_t> out;
    for (const std::size_t t : folds.tets)
      if (!given_up_[t] && !on_bones(t)) out.push_back(t);
    return out;
  }

  std::vector<PatchVolumes> parts_of(const Patches& patches, std::span<const float> nodes) const {
    const std::vector<double> now = volumes_.at(nodes);
    std::vector<PatchVolumes> parts(patches.count());
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t g) {
      parts[g] = PatchVolumes(volumes_, patches.free_of(g), nodes, now, patches.density(g));
    });
    std::vector<std::size_t> of_how_many(now.size(), 0);
    for (const PatchVolumes& part : parts)
      for (const std::size_t row : part.rows()) ++of_how_many[row];
    for (PatchVolumes& part : parts) part.share_out(of_how_many);
    return parts;
  }

  /// Takes back the patches of tissues that came out of their bounds all the same.
  void step_back(const Patches& patches, const std::vector<PatchVolumes>& parts,
                 std::span<const float> before, std::span<float> nodes) const {
    std::vector<std::uint8_t> back(patches.count(), 0);
    for (bool again = true; again;) {
      again = false;
      const std::vector<double> volume = volumes_.at(nodes);
      for (std::size_t g = 0; g < patches.count(); ++g) {
        const std::vector<std::size_t> rows = parts[g].rows();
        const bool beyond = std::any_of(rows.begin(), rows.end(), [&](std::size_t row) {
          return volumes_.beyond(row, volume[row]) > (1 - kAimed) * kTolerance;
        });
        if (!beyond || back[g] != 0) continue;
        back[g] = 1;
        again = true;
        patches.restore(g, before, nodes);
      }
    }
  }

  const Model& model_;
  const Context& context_;
  const std::vector<std::uint8_t> held_;
  std::vector<std::uint8_t> given_up_;
  const TissueVolumes volumes_;
};

}  // namespace

Unfolding unfold(const Model& model, PosedBody& body, const Context& context) {
  Unfolding out;
  Inverted now = inverted(model, body.nodes);
  out.inverted_before = now.tets.size();
  out.rest_mm3_before = now.rest_mm3;
  if (now.tets.empty()) return out;
  const std::vector<float> skinned = body.nodes;
  Unfolder unfolder(model, skinned, context);
  now = unfolder.run(body.nodes);
  // What cannot be unfolded pushes all about it away in vain: again without it.
  if (unfolder.give_up(now)) {
    std::vector<float> nodes = skinned;
    Inverted again = unfolder.run(nodes);
    if (again.rest_mm3 <= 1.1 * now.rest_mm3 && again.tets.size() <= out.inverted_before) {
      body.nodes.swap(nodes);
      now = std::move(again);
    }
  }
  out.inverted_after = now.tets.size();
  out.rest_mm3_after = now.rest_mm3;
  out.held = static_cast<std::uint64_t>(
      std::count_if(now.tets.begin(), now.tets.end(), [&](std::size_t t) { return unfolder.on_bones(t); }));
  std::vector<std::uint8_t> moved(model.node_count(), 0);
  for (std::size_t n = 0; n < moved.size(); ++n) {
    double squared = 0;
    for (std::size_t c = 3 * n; c < 3 * n + 3; ++c)
      squared += std::pow(static_cast<double>(body.nodes[c]) - static_cast<double>(skinned[c]), 2);
    if (squared == 0) continue;
    moved[n] = 1;
    ++out.moved_nodes;
    out.largest_move_mm = std::max(out.largest_move_mm, std::sqrt(squared));
  }
  carry_tissues(model, moved, body);
  return out;
}

}  // namespace ecorche::runtime
