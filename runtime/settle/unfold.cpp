// SPDX-License-Identifier: Apache-2.0
#include "runtime/settle/unfold.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include <ecorche/runtime/pose_quality.hpp>
#include "core/elastic/lbfgs.hpp"
#include "runtime/settle/carry_tissues.hpp"
#include "runtime/settle/fold_energy.hpp"
#include "runtime/settle/fold_patches.hpp"
#include "runtime/settle/patch_volumes.hpp"

namespace ecorche::runtime {
namespace {

constexpr int kRings[] = {2, 4, 7};  ///< of nodes about the folds, pass by pass
constexpr int kRounds = 12;          ///< of a pass: eps is lowered between them
constexpr int kSteps = 40;           ///< of a round
constexpr double kEnough = 0.02;     ///< det F that a patch is left with
constexpr double kLeastEps = 1e-3;
constexpr double kTie = 0.1;         ///< of a node to where skinning put it, against the shapes of mean tets
constexpr double kTolerance = 1e-3;  ///< of a tissue's rest volume, by which it may come out farther from it
constexpr double kAimed = 0.3;       ///< of the tolerance: what patches are held to
constexpr int kMoreRounds = 8;       ///< for volumes alone

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
    elastic::lbfgs(
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

class Unfolder {
 public:
  Unfolder(const Model& model, std::span<const float> skinned, const Context& context)
      : model_(model),
        context_(context),
        held_(held_nodes(model)),
        excluded_(model.tet_count(), 0),
        volumes_(model, skinned, kAimed * kTolerance) {}

  bool on_bones(std::size_t t) const {
    const auto tet = model_.tets.row(static_cast<Eigen::Index>(t));
    return std::all_of(tet.begin(), tet.end(),
                       [&](std::int32_t n) { return held_[static_cast<std::size_t>(n)] != 0; });
  }

  /// FoldPatches about the folds, narrow ones first. Returns what is left inverted.
  Inverted run(std::vector<float>& nodes) const {
    Inverted now = inverted(model_, nodes);
    for (const int rings : kRings) {
      const std::vector<std::size_t> seeds = unfoldable(now);
      if (seeds.empty()) break;
      const FoldPatches patches(model_, held_, excluded_, seeds, rings, nodes);
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
  bool exclude(const Inverted& left) {
    const std::vector<std::size_t> hopeless = unfoldable(left);
    for (const std::size_t t : hopeless) excluded_[t] = 1;
    return !hopeless.empty();
  }

 private:
  std::vector<std::size_t> unfoldable(const Inverted& folds) const {
    std::vector<std::size_t> out;
    for (const std::size_t t : folds.tets)
      if (!excluded_[t] && !on_bones(t)) out.push_back(t);
    return out;
  }

  std::vector<PatchVolumes> parts_of(const FoldPatches& patches, std::span<const float> nodes) const {
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
  void step_back(const FoldPatches& patches, const std::vector<PatchVolumes>& parts,
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
  std::vector<std::uint8_t> excluded_;
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
  if (unfolder.exclude(now)) {
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
