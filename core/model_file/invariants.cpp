// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/invariants.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <span>

#include <ecorche/values/volumetric_skeleton_check.hpp>
#include "core/model_file/correction_defect.hpp"
#include "core/model_file/in_turn.hpp"
#include "core/values/identifier.hpp"

namespace ecorche::model_file {
namespace {

constexpr double kRowSum = 1e-6;          // of weights, as Weights promises
constexpr double kBarycentric = 1e-4;     // float32, per unit of the largest coordinate
constexpr double kFrame = 1e-6;           // of joint frames, which ecorche makes itself
constexpr double kDirection = 1e-4;       // of images, which come from scanners' files
constexpr std::size_t kStride = 1 << 18;  // rows between two looks at the stop token
constexpr Eigen::Index kTetsPerPart = 1 << 18;

// Says no in the name of one dataset.
class Checker {
 public:
  Checker(const Model& model, const std::string& where, ErrorKind kind, const Context& context)
      : model_(model), where_(where), kind_(kind), context_(context) {}

  void run() {
    std::vector<std::function<void()>> parts;
    const auto part = [&](auto check) { parts.emplace_back(std::move(check)); };
    part([this] { check_rig(); });
    part([this] { check_sizes(); });
    part([this] { require_finite(model_.nodes, "/VTKHDF/Points"); });
    for (Eigen::Index t = 0; t < model_.tets.rows(); t += kTetsPerPart)
      part([this, t] { check_tets(t, std::min(model_.tets.rows(), t + kTetsPerPart)); });
    part([this] { check_labels(); });
    part([this] { check_materials(); });
    part([this] { check_weights(); });
    part([this] { check_centres(); });
    part([this] { check_names(model_.tissues, "/ecorche/tissues"); });
    for (const Tissue& tissue : model_.tissues) part([this, &tissue] { check_tissue(tissue); });
    part([this] { check_names(model_.volumes, "/ecorche/volumes"); });
    for (const ModelVolume& volume : model_.volumes) part([this, &volume] { check_volume(volume); });
    part([this] { check_names(model_.spheres, "/ecorche/spheres"); });
    for (const VolumetricSkeleton& skeleton : model_.spheres)
      part([this, &skeleton] { check_spheres(skeleton); });
    part([this] { check_corrections(); });
    run_as_in_turn(parts);
  }

 private:
  void require(bool good, std::string_view dataset, std::string_view what) const {
    if (good) return;
    throw Error(kind_, where_ + ":" + std::string(dataset), std::string(what),
                kind_ == ErrorKind::internal ? "report this" : "preprocess the case again");
  }
  // The text is only made where it is needed: these loops run over millions of rows.
  void require_row(bool good, std::string_view dataset, std::string_view what, std::size_t row) const {
    if (good) return;
    require(false, dataset, "row " + std::to_string(row) + " " + std::string(what));
  }
  void look(std::size_t row) const {
    if (row % kStride == 0) context_.check_stop();
  }

  template <class M>
  void require_finite(const M& matrix, std::string_view dataset) const {
    const auto columns = static_cast<std::size_t>(matrix.cols());
    const auto size = static_cast<std::size_t>(matrix.size());
    for (std::size_t i = 0; i < size; ++i) {
      look(i);
      require_row(std::isfinite(matrix.data()[i]), dataset, "is not finite", i / columns);
    }
  }
  template <class M>
  void require_indices(const M& matrix, Eigen::Index end, std::string_view dataset) const {
    const auto columns = static_cast<std::size_t>(matrix.cols());
    const auto size = static_cast<std::size_t>(matrix.size());
    for (std::size_t i = 0; i < size; ++i) {
      look(i);
      const auto index = matrix.data()[i];
      require_row(index >= 0 && index < end, dataset, "names a row that does not exist", i / columns);
    }
  }
  template <class Named>
  void check_names(const std::vector<Named>& things, const std::string& group) const {
    std::set<std::string_view> names;
    for (const Named& thing : things) {
      require(is_identifier(thing.name), group, "'" + thing.name + "' is not a name of [a-z0-9_]{1,64}");
      require(names.insert(thing.name).second, group, "'" + thing.name + "' stands twice");
    }
  }

  void check_rig() const {
    const std::vector<Segment>& segments = model_.rig.skeleton.segments;
    const std::string at = "/ecorche/skeleton/";
    require(!segments.empty() && segments.size() <= std::numeric_limits<std::uint16_t>::max(), at + "segment",
            "has no segments, or more than 65535");
    std::set<std::string_view> names, joints;
    for (std::size_t s = 0; s < segments.size(); ++s) {
      const Segment& segment = segments[s];
      const int row = static_cast<int>(s);
      require_row(is_identifier(segment.name) && names.insert(segment.name).second, at + "segment",
                  "is not a name of its own, of [a-z0-9_]{1,64}", s);
      require_row(s == 0 ? segment.parent == -1 : segment.parent >= 0 && segment.parent < row, at + "parent",
                  "does not name an earlier row (-1 for the root alone)", s);
      require_row(is_identifier(segment.joint.name) && joints.insert(segment.joint.name).second, at + "joint",
                  "is not a name of its own, of [a-z0-9_]{1,64}", s);
      check_joint(segment.joint, s);
    }
    for (std::size_t s = 0; s < segments.size(); ++s) check_couplings(segments[s].joint, s);
    require(model_.rig.fits.size() == segments.size(), at + "fit_joint", "is not one row per joint");
    for (std::size_t s = 0; s < segments.size(); ++s) {
      const JointFit& fit = model_.rig.fits[s];
      require_row(fit.joint == segments[s].joint.name, at + "fit_joint", "is not the joint of this row", s);
      require_row(std::isfinite(fit.radius_mm) && std::isfinite(fit.residual_mm) &&
                      std::isfinite(fit.inlier_share) && fit.confidence >= 0 && fit.confidence <= 1 &&
                      fit.points >= 0,
                  at + "fit_residual_mm", "is not finite", s);
    }
  }
  void check_joint(const Joint& joint, std::size_t row) const {
    const std::string at = "/ecorche/skeleton/";
    require_row(joint.center.allFinite(), at + "center", "is not finite", row);
    const Eigen::Matrix3d gram = joint.axes.transpose() * joint.axes;
    require_row(joint.axes.allFinite() && gram.isApprox(Eigen::Matrix3d::Identity(), kFrame) &&
                    joint.axes.determinant() > 0,
                at + "axes", "is not orthonormal and right-handed", row);
    require_row(joint.sequence.size() == 3, at + "angle_joint", "has not three angles", row);
    std::set<std::string_view> names;
    std::set<int> axes;
    for (const AngleAxis& angle : joint.sequence) {
      require_row(!angle.name.empty() && names.insert(angle.name).second, at + "angle_name",
                  "has an angle without a name of its own", row);
      require_row(angle.axis >= 0 && angle.axis < 3 && axes.insert(angle.axis).second, at + "angle_axis",
                  "does not turn about three different axes", row);
      require_row(angle.sign == 1 || angle.sign == -1, at + "angle_sign", "is neither 1 nor -1", row);
      require_row(std::isfinite(angle.rest), at + "angle_rest", "is not finite", row);
      require_row(angle.min <= angle.max, at + "angle_min", "has a limit above the other", row);
    }
  }
  void check_couplings(const Joint& joint, std::size_t row) const {
    const auto has_angle = [](const Joint& of, const std::string& name) {
      return std::any_of(of.sequence.begin(), of.sequence.end(),
                         [&](const AngleAxis& angle) { return angle.name == name; });
    };
    const Skeleton& skeleton = model_.rig.skeleton;
    for (const Coupling& coupling : joint.coupled) {
      const int leader = skeleton.find_joint(coupling.joint);
      const bool slides = coupling.slides() >= 0;
      require_row(leader >= 0 && (slides || leader != static_cast<int>(row)),
                  "/ecorche/skeleton/coupling_leader", "does not name another joint", row);
      require_row(has_angle(skeleton.segments[static_cast<std::size_t>(leader)].joint, coupling.angle) &&
                      (slides || has_angle(joint, coupling.drives)),
                  "/ecorche/skeleton/coupling_angle", "couples angles that do not exist", row);
      require_row(std::isfinite(coupling.ratio), "/ecorche/skeleton/coupling_ratio", "is not finite", row);
    }
  }

  void check_sizes() const {
    require(model_.nodes.rows() > 0 && model_.nodes.rows() <= std::numeric_limits<std::int32_t>::max(),
            "/VTKHDF/Points", "has no rows, or too many for 32-bit indices");
    require(model_.tets.rows() > 0 && model_.tets.size() < std::numeric_limits<std::int32_t>::max(),
            "/VTKHDF/Connectivity", "has no tets, or too many for 32-bit offsets");
  }
  void check_tets(Eigen::Index begin, Eigen::Index end) const {
    context_.check_stop();
    for (Eigen::Index t = begin; t < end; ++t) {
      const auto row = static_cast<std::size_t>(t);
      for (int c = 0; c < 4; ++c) {
        const auto node = model_.tets(t, c);
        require_row(node >= 0 && node < model_.nodes.rows(), "/VTKHDF/Connectivity",
                    "names a row that does not exist", row);
      }
      const auto corner = [&](int c) { return model_.nodes.row(model_.tets(t, c)); };
      require_row(tet_det(corner(0), corner(1), corner(2), corner(3)) > 0, "/VTKHDF/Connectivity",
                  "is a tet without positive volume", row);
    }
  }
  void check_labels() const {
    const std::size_t bones = model_.bone_names.size();
    require(model_.bone_segment.size() == bones, "/ecorche/labels/segment", "is not one row per bone");
    std::set<std::string_view> names;
    for (std::size_t b = 0; b < bones; ++b) {
      require_row(is_identifier(model_.bone_names[b]) && names.insert(model_.bone_names[b]).second,
                  "/ecorche/labels/bone", "is not a name of its own, of [a-z0-9_]{1,64}", b);
      require_row(is_segment(model_.bone_segment[b]), "/ecorche/labels/segment", "names no segment", b);
    }
    require(model_.tet_label.size() == model_.tet_count(), "/VTKHDF/CellData/label",
            "is not one row per tet");
    for (std::size_t t = 0; t < model_.tet_label.size(); ++t) {
      require_row(model_.tet_label[t] <= bones, "/VTKHDF/CellData/label", "names no bone", t);
    }
    check_contested();
  }
  // Only where there are any: models made before there were have their tets in another order.
  void check_contested() const {
    const std::size_t count = model_.contested.size(), tets = model_.tet_label.size();
    if (count == 0) return;
    const std::string_view at = "/ecorche/labels/contested";
    const auto first =
        static_cast<std::size_t>(std::find(model_.tet_label.begin(), model_.tet_label.end(), TetMesh::soft) -
                                 model_.tet_label.begin());
    require(count <= tets - first, at, "has more rows than there are soft tets");
    for (std::size_t t = first; t < tets; ++t) {
      require_row(model_.tet_label[t] == TetMesh::soft, "/VTKHDF/CellData/label",
                  "is of a bone behind a soft one, although tets are contested", t);
    }
    for (std::size_t t = 0; t < count; ++t) {
      const std::uint16_t label = model_.contested[t];
      require_row(label != TetMesh::soft && label <= model_.bone_names.size(), at, "names no bone", t);
    }
  }
  void check_materials() const {
    const Materials& materials = model_.materials;
    const std::string tissue = "/ecorche/materials/tissue", tet = "/ecorche/materials/tet";
    require(materials.young_kpa.size() == materials.tissue.size(), "/ecorche/materials/young_kpa",
            "is not one row per material");
    require(materials.of_tet.size() == (materials.empty() ? 0 : model_.tet_count()), tet,
            "is not one row per tet");
    for (std::size_t m = 0; m < materials.tissue.size(); ++m) {
      const std::int32_t row = materials.tissue[m];
      require_row(m == 0 ? row == -1 : row > materials.tissue[m - 1], tissue, "is not -1, then ascending", m);
      require_row(row < static_cast<std::int32_t>(model_.tissues.size()), tissue, "names no tissue", m);
      require_row(materials.young_kpa[m] > 0 && std::isfinite(materials.young_kpa[m]),
                  "/ecorche/materials/young_kpa", "is not positive", m);
    }
    for (std::size_t t = 0; t < materials.of_tet.size(); ++t)
      require_row(materials.of_tet[t] < materials.tissue.size(), tet, "names no material", t);
  }
  bool is_segment(std::int32_t row) const {
    return row >= 0 && static_cast<std::size_t>(row) < model_.segment_count();
  }

  void check_weights() const {
    const Weights& w = model_.weights;
    const std::string_view offsets = "/ecorche/weights/offsets", weight = "/ecorche/weights/weight";
    require(w.offsets.size() == model_.node_count() + 1, offsets, "has not one row per node and one more");
    require(w.segment.size() == w.weight.size(), "/ecorche/weights/segment", "is not as long as weight");
    require(w.offsets.front() == 0 && w.offsets.back() == w.weight.size(), offsets,
            "does not run from 0 to the number of weights");
    for (std::size_t n = 0; n < model_.node_count(); ++n) {
      require_row(w.offsets[n] < w.offsets[n + 1], offsets, "does not grow", n);
    }
    for (std::size_t n = 0; n < model_.node_count(); ++n) {
      look(n);
      double sum = 0;
      for (std::size_t e = w.offsets[n]; e < w.offsets[n + 1]; ++e) {
        require_row(w.segment[e] < model_.segment_count(), "/ecorche/weights/segment", "names no segment", e);
        require_row(e == w.offsets[n] || w.segment[e - 1] < w.segment[e], "/ecorche/weights/segment",
                    "is not sorted within its node", e);
        require_row(w.weight[e] >= 0 && w.weight[e] <= 1, weight, "is not in [0, 1]", e);
        sum += static_cast<double>(w.weight[e]);
      }
      require_row(std::abs(sum - 1) <= kRowSum, weight, "(a node) does not sum to 1", n);
    }
  }
  void check_centres() const {
    const CorCentres& cor = model_.cor;
    require(cor.centre.rows() == model_.nodes.rows(), "/ecorche/cor/centre", "is not one row per node");
    require(cor.has_centre.size() == model_.node_count(), "/ecorche/cor/has_centre",
            "is not one row per node");
    require_finite(cor.centre, "/ecorche/cor/centre");
    for (std::size_t n = 0; n < cor.has_centre.size(); ++n) {
      require_row(cor.has_centre[n] <= 1, "/ecorche/cor/has_centre", "is neither 0 nor 1", n);
    }
    require(cor.sigma > 0 && std::isfinite(cor.sigma), "/ecorche/cor/sigma", "is not positive");
  }

  void check_tissue(const Tissue& tissue) const {
    const std::string at = "/ecorche/tissues/" + tissue.name + "/";
    require(tissue.V.rows() <= std::numeric_limits<std::int32_t>::max(), at + "points", "has too many rows");
    require_finite(tissue.V, at + "points");
    require_indices(tissue.F, tissue.V.rows(), at + "triangles");
    if (tissue.segment != Tissue::by_tets) {
      require(is_segment(tissue.segment), at + "segment", "names no segment");
      require(tissue.tet.empty() && tissue.barycentric.rows() == 0, at + "tet",
              "has rows, although the tissue follows a segment");
      return;
    }
    require(static_cast<Eigen::Index>(tissue.tet.size()) == tissue.V.rows(), at + "tet",
            "is not one row per vertex");
    require(tissue.barycentric.rows() == tissue.V.rows(), at + "barycentric", "is not one row per vertex");
    const std::string tet = at + "tet", barycentric = at + "barycentric";
    require_finite(tissue.barycentric, barycentric);
    for (std::size_t v = 0; v < tissue.tet.size(); ++v) {
      look(v);
      require_row(tissue.tet[v] >= 0 && tissue.tet[v] < model_.tets.rows(), tet, "names no tet", v);
      const auto row = tissue.barycentric.row(static_cast<Eigen::Index>(v)).cast<double>();
      // Far outside a thin tet the coordinates are large, and float32 rounds each by its own size.
      const double scale = std::max(1.0, row.cwiseAbs().maxCoeff());
      require_row(std::abs(row.sum() - 1) <= kBarycentric * scale, barycentric, "does not sum to 1", v);
    }
  }

  void check_volume(const ModelVolume& volume) const {
    const std::string at = "/ecorche/volumes/" + volume.name + "/";
    const ImageGrid& grid = volume.image.grid;
    std::uint64_t bytes = scalar_bytes(volume.image.type);
    const auto times = [&](std::int32_t factor) {
      return factor > 0 && !__builtin_mul_overflow(bytes, static_cast<std::uint64_t>(factor), &bytes);
    };
    require(times(grid.size[0]) && times(grid.size[1]) && times(grid.size[2]), at + "size",
            "is not positive");
    require(times(volume.image.components), at + "components", "is not positive");
    require(bytes == volume.image.bytes.size(), at + "voxels", "is not as large as its grid");
    for (std::size_t i = 0; i < 3; ++i) {
      require(std::isfinite(grid.origin[i]), at + "origin", "is not finite");
      require(std::isfinite(grid.spacing[i]) && grid.spacing[i] > 0, at + "spacing", "is not positive");
    }
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> direction(grid.direction.data());
    const Eigen::Matrix3d gram = direction.transpose() * direction;
    require(direction.allFinite() && gram.isApprox(Eigen::Matrix3d::Identity(), kDirection), at + "direction",
            "is not orthonormal");
    require(std::isfinite(volume.background), at + "background", "is not finite");
  }

  void check_spheres(const VolumetricSkeleton& skeleton) const {
    const std::string at = "/ecorche/spheres/" + skeleton.name;
    context_.check_stop();
    const std::string defect = first_defect(skeleton);
    require(defect.empty(), at, defect);
    require(skeleton.parent.size() == skeleton.size(), at + "/parent", "is not one row per voxel");
    require(skeleton.segment.size() == skeleton.size(), at + "/segment", "is not one row per voxel");
    for (std::size_t r = 0; r < skeleton.size(); ++r) {
      look(r);
      require_row(is_segment(skeleton.segment[r]), at + "/segment", "names no segment", r);
    }
  }

  void check_corrections() const {
    context_.check_stop();
    if (const auto defect = first_defect_of_corrections(model_))
      require(false, defect->dataset, defect->what);
  }

  const Model& model_;
  const std::string& where_;
  const ErrorKind kind_;
  const Context& context_;
};

}  // namespace

void check_invariants(const Model& model, const std::string& where, ErrorKind kind, const Context& context) {
  Checker(model, where, kind, context).run();
}

}  // namespace ecorche::model_file
