// SPDX-License-Identifier: Apache-2.0
// Points both ways through a posed body: where a posed point was at rest and what is there, and where a rest
// point went.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <ecorche/runtime/held_arrays.hpp>
#include <ecorche/runtime/resample.hpp>
#include <ecorche/runtime/tet_runs.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// What to say of every point besides the tet that holds it and where it is on the other side.
struct ProbeOptions {
  /// A volume to sample.
  struct Volume {
    std::uint32_t row = 0;                    ///< of Model::volumes
    Sampling sampling = Sampling::trilinear;  ///< labels are always sampled nearest
  };
  bool gradient = false;
  bool tissue =
      false;  ///< by the surfaces: most of the time of a probe; the first who asks waits a second more
  std::vector<Volume> volumes = {};
};

/// In which order points are looked at; kept from call to call, so that nothing is allocated again.
struct ProbeOrder {
  std::vector<std::uint32_t> places, rows, other;
};

/// One row per point, #P.
struct Probed {
  std::vector<std::int32_t> tet;   ///< TetPlace::none where the point lies outside the body
  std::vector<float> barycentric;  ///< 4 * #P, of the tet's corners; the same at rest and posed
  std::vector<float> points;       ///< 3 * #P, LPS mm, on the other side; NaN outside
  /// Of the tet: TetMesh::soft, or 1 + the row of its bone, which a contested tet has where it is drawn
  /// rigidly (rigid_copies.hpp); 0 outside.
  std::vector<std::uint16_t> label;
  std::vector<float> gradient;       ///< 9 * #P, row by row: F = d posed / d rest of the tet; NaN outside
  std::vector<std::int32_t> tissue;  ///< the row of the innermost tissue whose closed surface
                                     ///< holds the rest point; -1 (TissueColumns::none) outside
  std::vector<std::vector<double>> values;  ///< per wanted volume, #P * components; its background outside
  ProbeOrder order;
};

/// Made once per model; shared and immutable, as BodyPoser is. The body is its tets: what lies in the skin's
/// surface but in no tet (the skin may stand a little off the mesh) is outside. Where the posed body folds
/// over itself the tet is the one that posed volumes take (volume_poser.hpp): a positive one before an
/// inverted one, then the lowest drawn index. Results are the same for any number of threads.
class Probe {
 public:
  /// `given`: #nodes, the row of a node in what follow() is given (as BodyPoser::lanes tells of its lanes);
  /// empty: its own.
  explicit Probe(std::shared_ptr<const Model> model, std::span<const std::uint32_t> given = {});
  ~Probe();

  /// The tree about one posed body. Kept from pose to pose, so that nothing of the body's size is allocated
  /// again. Blocks of it are fitted by who first asks for a point in them.
  struct PosedTree {
    PaddedNodes nodes;
    std::vector<float> copied;
    mutable BoxTree boxes;
  };
  /// Must follow every new pose; nobody may ask meanwhile. `nodes`: 3 a row, LPS mm, those of nodes finite.
  /// O(#nodes), parallel.
  void follow(std::span<const float> nodes, PosedTree& tree) const;
  /// All of the tree, several times the work of follow(), so that no point waits for its block. Parallel.
  void fit(const PosedTree& tree) const;

  /// `points`: 3 * #P, LPS mm; those that are not finite lie outside. Any number of threads may ask the same
  /// tree. Throws Error{usage} for a volume that the model has not.
  void posed_to_rest(const PosedTree& tree, std::span<const float> points, const ProbeOptions& wants,
                     Probed& out) const;
  /// Points of the scan into the posed body.
  void rest_to_posed(const PosedTree& tree, std::span<const float> points, const ProbeOptions& wants,
                     Probed& out) const;

  /// What is probed.
  const Model& model() const;

  /// What it holds besides the model, but for what the first who asks for tissues waits for.
  HeldArrays arrays() const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace ecorche::runtime
