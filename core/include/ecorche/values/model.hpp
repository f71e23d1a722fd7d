// SPDX-License-Identifier: Apache-2.0
// A prepared body: what `preprocess` makes and everything else reads.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/correction.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/values/mesh.hpp>
#include <ecorche/values/skeleton.hpp>
#include <ecorche/values/volumetric_skeleton.hpp>

namespace ecorche {

/// Skinning weights, compressed by row: node n has entries offsets[n] .. offsets[n+1].
/// Entries of a row are sorted by segment, at least 1e-6 each, and sum to 1 within 1e-6.
struct Weights {
  std::vector<std::uint64_t> offsets;  ///< #nodes + 1
  std::vector<std::uint16_t> segment;  ///< row of the skeleton
  std::vector<float> weight;           ///< in [0, 1]
};

/// Centres of rotation of the nodes (LeHodgins16; Sujar18 eqs. 6-7).
struct CorCentres {
  PointsF centre;                        ///< #nodes by 3, LPS mm; the node itself where has_centre is 0
  std::vector<std::uint8_t> has_centre;  ///< 0: no tet resembles the node, which is then skinned by LBS
  double sigma = 0.05;
};

/// A surface that follows the body: rigidly with one segment (bones), or by tets.
struct Tissue {
  static constexpr std::int32_t by_tets = -1;

  std::string name;
  Group group = Group::other;
  PointsF V;                       ///< #V by 3, rest, LPS mm
  Triangles F;                     ///< #F by 3
  std::int32_t segment = by_tets;  ///< owning segment of a bone
  std::vector<std::int32_t> tet;   ///< #V, nearest or containing tet; empty for bones
  /// #V by 4, barycentric coordinates in that tet; they sum to 1, and are signed outside the mesh.
  Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor> barycentric;
};

/// How stiff flesh is, where the case says so. Empty, and the same everywhere, where it does not.
struct Materials {
  /// By material: the row of the tissue whose flesh it is. First -1, flesh of no tissue that says its own;
  /// then ascending.
  std::vector<std::int32_t> tissue;
  std::vector<double> young_kpa;      ///< by material, Young's modulus
  std::vector<std::uint16_t> of_tet;  ///< #T, row of the material; 0 for tets of bones, which are rigid

  bool empty() const { return tissue.empty(); }  ///< True where no tissue says how stiff it is.
};

/// A sampled volume that follows the body.
struct ModelVolume {
  std::string name;
  Image image;
  double background = 0;
  bool labels = false;                        ///< posed by nearest sampling only
  std::map<std::int64_t, std::string> table;  ///< names of the label ids
};

/// What was measured on the model when it was made; `verify` measures it again.
struct Certificate {
  // As solved, in double precision, before repair.
  double solver_residual = 0;  ///< largest relative residual over the right-hand sides
  double first_violation =
      0;  ///< how far the equation's own solution leaves [0, 1], before any tie is mended
  std::uint64_t mended_nodes = 0;    ///< nodes whose ties were mended, and all was solved again
  double mended_largest_change = 0;  ///< of any weight by that
  double solved_min_weight = 0;
  double solved_max_weight = 0;
  double solved_row_sum_error = 0;
  std::uint64_t repaired_rows = 0;
  double repaired_largest_change = 0;
  // As stored.
  double min_weight = 0;
  double max_weight = 0;
  double row_sum_error = 0;
  // The mesh.
  double min_dihedral_deg = 0;
  double max_dihedral_deg = 0;
  std::uint64_t inverted_tets = 0;
  std::uint64_t degenerate_tets = 0;  ///< flat, or with an edge that float32 hardly resolves
  double min_edge_mm = 0;
  double positive_offdiagonal_share = 0;
  // The tissues.
  std::uint64_t tissue_vertices = 0;
  std::uint64_t outside_vertices = 0;
  double max_outside_mm = 0;
  // The bones: their tets and those that two segments contested; then the largest residual, mm, of the best
  // rigid fit of any bone mesh in the probe pose.
  std::uint64_t bone_tets = 0;
  std::uint64_t contested_tets = 0;
  double contested_share = 0;   ///< of the volume of both
  double least_bone_share = 0;  ///< of its volume that a bone keeps in tets of its own
  double bone_tet_change =
      0;  ///< largest, of an edge or the volume of a bone tet in the probe pose, as a share
  double bone_rigidity_mm = 0;
};

/// A prepared body: what `ecorche preprocess` makes, and what is posed.
struct Model {
  std::string name;
  Rig rig;
  PointsF nodes;                         ///< #nodes by 3, rest, LPS mm, Morton order
  Tets tets;                             ///< #T by 4, positive volume in the float32 nodes
  std::vector<std::uint16_t> tet_label;  ///< #T, see TetMesh; tets of bones come first
  /// Of the soft tets that follow those of bones, in that order: the label of the bone that each lies in. A
  /// corner of it belongs to another segment's bone, so that it cannot move rigidly with its own; drawn, it
  /// does (runtime/volume/rigid_copies.hpp).
  std::vector<std::uint16_t> contested;
  Materials materials;
  std::vector<std::string> bone_names;     ///< bone i has label i + 1
  std::vector<std::int32_t> bone_segment;  ///< #bones, row of the owning segment
  Weights weights;
  CorCentres cor;
  std::vector<Tissue> tissues;       ///< skin first, then bones, then the case's order
  std::vector<ModelVolume> volumes;  ///< the case's order; the label map last, under the name "labels"
  /// Bodies as balls, for the deformer that needs no tets; each with its tree, and every voxel hung on a
  /// segment of the rig. Empty unless asked for.
  std::vector<VolumetricSkeleton> spheres;
  Certificate certificate;
  std::map<std::string, std::string> provenance;  ///< options, versions, input digests; no times
  /// Ascending by joint. Empty unless `ecorche calibrate` made them, as are the ranges.
  std::vector<JointCorrection> corrections;
  std::vector<PoseCorrection> pose_corrections;
  std::vector<SafeRange> safe_ranges;  ///< ascending by joint, then angle, then way

  /// Whether skinning about centres of rotation is corrected.
  bool corrected() const { return !corrections.empty() || !pose_corrections.empty(); }
  /// Nodes of the tets.
  std::size_t node_count() const { return static_cast<std::size_t>(nodes.rows()); }
  /// Tets.
  std::size_t tet_count() const { return static_cast<std::size_t>(tets.rows()); }
  /// Segments, and joints.
  std::size_t segment_count() const { return rig.skeleton.segments.size(); }
};

}  // namespace ecorche
