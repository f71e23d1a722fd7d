// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/inspect_case.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <optional>

#include "core/geometry/face_tree.hpp"
#include "core/values/spine.hpp"
#include "core/values/text.hpp"
#include "preprocess/check/frames.hpp"
#include "preprocess/check/image_places.hpp"
#include "preprocess/check/inside.hpp"
#include "preprocess/check/inside_cells.hpp"
#include "preprocess/check/label_ids.hpp"
#include "preprocess/check/self_intersections.hpp"
#include "preprocess/check/surface_parts.hpp"

namespace ecorche::check {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

// A person's skin is between a finger and a giant; anything else is in another unit.
constexpr double kSmallestSkin = 20, kLargestSkin = 3000;
constexpr double kLikelySkin = 100;     // what a change of unit aims at
constexpr std::size_t kSampled = 3000;  // vertices of bones that are tried in other frames

std::string plural(std::int64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

std::int64_t count_of(const std::vector<Hole>& holes) {
  return static_cast<std::int64_t>(holes.size());
}

// `10 times larger`: what a unit should be.
std::string larger(double factor) {
  return factor > 1 ? std::to_string(std::lround(factor)) + " times larger"
                    : std::to_string(std::lround(1 / factor)) + " times smaller";
}

// What closes them all; nothing closes chains that form no loop.
std::string closing_of(const std::vector<Hole>& holes) {
  double edge = 0;
  for (const Hole& hole : holes) edge = std::max(edge, hole.filling_edge);
  return edge > 0 ? "ecorche repair --holes " + text::number(std::ceil(1.05 * edge)) + " closes them"
                  : "their edges form no loop: mend them where the surface was made";
}

AlignedBox3d bounds(const SurfaceFigures& figures) {
  return {figures.low, figures.high};
}

class Inspector {
 public:
  Inspector(const Case& patient, const Context& context, const Options& options)
      : patient_(patient), context_(context), options_(options) {}

  Report run() {
    report_.surfaces.push_back({patient_.skin_name, Group::skin, {}, 0, 0, {}, false, {}});
    meshes_.push_back(&patient_.skin);
    for (const CaseBone& bone : patient_.bones) {
      report_.surfaces.push_back({bone.name, Group::bone, {}, 0, 0, {}, false, {}});
      meshes_.push_back(&bone.surface);
    }
    for (const CaseTissue& tissue : patient_.tissues) {
      report_.surfaces.push_back({tissue.name, tissue.group, {}, 0, 0, {}, false, {}});
      meshes_.push_back(&tissue.surface);
    }
    look_at_surfaces();
    for (std::size_t i = 0; i < meshes_.size(); ++i) {
      inspect_surface(report_.surfaces[i], parts_[i]);
      if (i == 0) check_skin();
    }
    if (patient_.bones.empty())
      add_finding(Severity::error, "bones", "there is none", {}, "a case needs at least one bone");
    if (patient_.skin.F.rows() > 0) {
      check_places();
      check_sizes();
      check_agreement();
      inspect_outside();
    }
    check_segments();
    check_volumes();
    return std::move(report_);
  }

 private:
  void add_finding(Severity severity, std::string where, std::string what, const std::optional<Vector3d>& at,
                   std::string mend) {
    report_.findings.push_back({severity, std::move(where), std::move(what), at, std::move(mend)});
  }

  // All that is measured, the surfaces side by side.
  void look_at_surfaces() {
    parts_.resize(meshes_.size());
    if (patient_.skin.V.rows() > 0)
      skin_mm_ = (patient_.skin.V.colwise().maxCoeff() - patient_.skin.V.colwise().minCoeff()).maxCoeff();
    std::optional<geometry::FaceTree> skin;
    tbb::parallel_invoke([&] { inside_.emplace(patient_.skin); }, [&] { skin.emplace(patient_.skin); },
                         [&] { report_.surfaces[0].figures = measure(patient_.skin); });
    if (report_.surfaces[0].figures.closed()) cells_.emplace(patient_.skin, *inside_);
    std::size_t all = 1, done = 0;
    for (const SurfaceMesh* mesh : meshes_) all += static_cast<std::size_t>(mesh->F.rows());
    std::mutex mutex;
    tbb::parallel_for(std::size_t{0}, meshes_.size(), [&](std::size_t i) {
      context_.check_stop();
      const SurfaceMesh& mesh = *meshes_[i];
      SurfaceLine& line = report_.surfaces[i];
      if (i > 0) line.figures = measure(mesh);
      parts_[i] = surface_parts(mesh);
      for (std::int32_t p = 0; p < parts_[i].classes.count; ++p) {
        line.specks += parts_[i].speck(p, speck_mm);
        line.inner += parts_[i].parts[static_cast<std::size_t>(p)].inside >= 0;
      }
      line.drawn = options_.drawn.contains(line.name);
      if (!line.drawn) line.intersections = self_intersections(mesh, context_);
      if (i > 0 && patient_.skin.F.rows() > 0) line.outside = measure_outside(mesh, *skin);
      const std::lock_guard lock(mutex);
      context_.report(static_cast<double>(done += static_cast<std::size_t>(mesh.F.rows())) /
                      static_cast<double>(all));
    });
  }

  Outside measure_outside(const SurfaceMesh& mesh, const geometry::FaceTree& skin) const {
    Outside out;
    std::int32_t hint = -1;
    for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
      if (v % 4096 == 0) context_.check_stop();
      const Vector3d p = mesh.V.row(v).transpose();
      if (cells_ ? (*cells_)(p) : (*inside_)(p)) continue;
      const geometry::FaceTree::Hit hit = skin.nearest(p, hint);
      hint = hit.face;
      const double distance = std::sqrt(hit.squared);
      if (distance <= touching_share * skin_mm_) continue;
      ++out.count;
      if (distance > out.largest_mm) {
        out.largest_mm = distance;
        out.farthest = p;
      }
    }
    if (mesh.V.rows() > 0) out.share = static_cast<double>(out.count) / static_cast<double>(mesh.V.rows());
    return out;
  }

  // One surface by itself. Only skin and bones are filled when a body is prepared: faults of the rest do no
  // harm.
  void inspect_surface(const SurfaceLine& line, const SurfaceParts& parts) {
    const SurfaceFigures& figures = line.figures;
    const std::string& name = line.name;
    const Severity harm =
        line.group == Group::skin || line.group == Group::bone ? Severity::warning : Severity::note;
    const auto add_offenders = [&](const Offenders& offenders, Severity severity, const std::string& noun,
                                   const std::string& mend) {
      if (offenders.count > 0)
        add_finding(severity, name, plural(offenders.count, noun), offenders.first, mend);
    };
    if (figures.triangles == 0)
      add_finding(line.group == Group::skin ? Severity::error : harm, name, "has no triangle", {},
                  "export it again");
    if (!figures.holes.empty()) {
      const Hole& longest = figures.holes.front();
      add_finding(harm, name,
                  plural(figures.open.count, "open edge") + " in " + plural(count_of(figures.holes), "hole") +
                      ", the longest of " + plural(longest.edges, "edge") + " and " +
                      text::number(longest.length_mm) + " mm",
                  longest.middle, closing_of(figures.holes));
    }
    add_offenders(figures.nonmanifold, harm, "non-manifold edge", "let at most two triangles share an edge");
    add_offenders(figures.turned, harm, "flipped triangle", "orient all triangles outward");
    if (figures.flipped.count > 0 && figures.turned.count == 0)
      add_offenders(figures.flipped, harm, "inconsistently oriented edge", "orient all triangles outward");
    add_offenders(figures.duplicate, Severity::note, "duplicate triangle", "keep one of each");
    add_offenders(figures.degenerate, Severity::note, "degenerate triangle", "remove it");
    if (line.intersections) {
      const std::int64_t count = line.intersections->count;
      if (count > 0)
        add_finding(Severity::note, name,
                    plural(count, "pair") + " of its triangles meet" + (count == 1 ? "s" : ""),
                    line.intersections->first, "voxels do not mind; mend it if a simulator will read it");
    }
    if (figures.closed() && figures.triangles > 0 && figures.volume_mm3 < 0) {
      add_finding(harm, name,
                  "is inside out: its volume is " + text::number(figures.volume_mm3 / 1000) + " ml", {},
                  "flip its triangles, or mend the frame");
    }
    inspect_parts(line, parts);
  }

  void inspect_parts(const SurfaceLine& line, const SurfaceParts& parts) {
    const auto first = [&](auto&& wanted) {
      std::int32_t p = 0;
      while (!wanted(p)) ++p;
      return Vector3d(parts.parts[static_cast<std::size_t>(p)].box.center());
    };
    if (line.specks > 0) {
      add_finding(Severity::note, line.name,
                  plural(line.specks, "speck") + " less than " + text::number(speck_mm) + " mm across",
                  first([&](std::int32_t p) { return parts.speck(p, speck_mm); }),
                  "ecorche repair drops them");
    }
    if (line.inner > 0) {
      add_finding(Severity::note, line.name, plural(line.inner, "closed part") + " inside another",
                  first([&](std::int32_t p) { return parts.parts[static_cast<std::size_t>(p)].inside >= 0; }),
                  "a cavity stays hollow; ecorche repair --drop-inner fills it");
    }
    const std::int64_t left = line.figures.components - line.specks - line.inner;
    if (line.group == Group::skin && left > 1)
      add_finding(Severity::note, line.name, "has " + plural(left, "part"), {},
                  "keep the outer surface only");
  }

  void check_skin() {
    const SurfaceFigures& skin = report_.surfaces.front().figures;
    if (skin.triangles == 0) return;
    const double extent = (skin.high - skin.low).maxCoeff();
    const bool flat = (skin.high - skin.low).minCoeff() <= 1e-6 * extent;
    if (flat || (skin.closed() && !(std::abs(skin.volume_mm3) > 1e-6 * extent * extent * extent))) {
      add_finding(Severity::error, patient_.skin_name, "encloses no volume", {}, "export the skin again");
    }
    if (extent < kSmallestSkin || extent > kLargestSkin) {
      const double factor = unit_factor(extent, kLikelySkin, kLargestSkin);
      add_finding(Severity::warning, patient_.skin_name, "is " + text::number(extent) + " mm long", {},
                  factor > 0 ? "mend the case's unit: with one " + larger(factor) + " it would be " +
                                   text::number(extent * factor) + " mm"
                             : "mend the case's unit, if that is wrong");
    }
  }

  // Bounds that do not meet: most often another frame or unit.
  void check_places() {
    const AlignedBox3d skin = bounds(report_.surfaces.front().figures);
    std::size_t bones_away = 0;
    for (std::size_t i = 1; i < report_.surfaces.size(); ++i) {
      const SurfaceLine& line = report_.surfaces[i];
      if (line.figures.triangles == 0 || skin.intersects(bounds(line.figures))) continue;
      bones_away += line.group == Group::bone;
      add_finding(Severity::warning, line.name, "lies wholly outside the skin's bounds", line.figures.low,
                  "mend its frame or unit");
    }
    if (bones_away > 0 && bones_away == patient_.bones.size()) {
      add_finding(Severity::error, "bones", "all lie outside the skin's bounds", {},
                  "mend the frame or unit of skin or bones");
    }
  }

  // A surface by itself in another unit.
  void check_sizes() {
    const SurfaceFigures& skin = report_.surfaces.front().figures;
    const double whole = (skin.high - skin.low).maxCoeff();
    for (std::size_t i = 1; i < report_.surfaces.size(); ++i) {
      const SurfaceFigures& figures = report_.surfaces[i].figures;
      const double extent = (figures.high - figures.low).maxCoeff();
      if (figures.triangles == 0 || (extent <= 1.5 * whole && extent >= 1e-3 * whole)) continue;
      const double factor = unit_factor(extent, 1e-2 * whole, whole);
      add_finding(Severity::warning, report_.surfaces[i].name,
                  "is " + text::number(extent) + " mm long, the skin " + text::number(whole) + " mm",
                  figures.low,
                  factor > 0 ? "mend its unit: with one " + larger(factor) + " it would be " +
                                   text::number(extent * factor) + " mm"
                             : "mend its unit, if that is wrong");
    }
  }

  // Bones of which most lie outside, or that fill almost nothing of the body: is there a frame that agrees?
  void check_agreement() {
    const auto most =
        static_cast<Eigen::Index>(kSampled / std::max<std::size_t>(1, patient_.bones.size()) + 1);
    std::vector<Vector3d> points;
    for (const CaseBone& bone : patient_.bones) {
      const std::vector<Vector3d> some = sample_vertices(bone.surface, most);
      points.insert(points.end(), some.begin(), some.end());
    }
    const SurfaceFigures& skin = report_.surfaces.front().figures;
    const auto found = find_agreement(points, *inside_, (skin.high - skin.low).maxCoeff());
    if (!found) return;
    std::string what = "bones and skin do not agree: ";
    std::string mend;
    if (!found->axes.isIdentity()) {
      what += "turned " + found->turn();
      mend = "give the bones frame: " + found->code() + " if it is LPS now";
    }
    if (found->scale != 1) {
      what += (mend.empty() ? "" : " and ") + found->size();
      mend += std::string(mend.empty() ? "" : ", and ") + "a unit " + larger(found->scale);
    }
    add_finding(Severity::warning, "bones",
                what + ", " + text::number(100 * found->share) + " % of the bones lie inside", {}, mend);
  }

  void inspect_outside() {
    for (std::size_t i = 1; i < report_.surfaces.size(); ++i) {
      const SurfaceLine& line = report_.surfaces[i];
      if (!line.outside || line.outside->count == 0) continue;
      const Outside& out = *line.outside;
      const bool bone = line.group == Group::bone;
      if (!bone && out.largest_mm <= tissue_outside_share * skin_mm_) continue;
      const bool lost = !bone && out.largest_mm > tissue_lost_share * skin_mm_;
      add_finding(bone || lost ? Severity::warning : Severity::note, line.name,
                  std::to_string(out.count) + (out.count == 1 ? " vertex (" : " vertices (") +
                      text::number(100 * out.share) + " %) outside the skin, by up to " +
                      text::number(out.largest_mm) + " mm",
                  out.farthest,
                  lost ? "mend its frame or unit: farther out than 10 % of the body's length no model is made"
                  : bone ? "the body will be skin and bones together; mend one of them if that is not meant"
                         : "it will follow the nearest part of the body; mend it if that is not meant");
    }
  }

  void check_segments() {
    const auto& segments = patient_.skeleton.segments;
    for (const Segment& segment : segments) {
      const auto owns = [&](const Segment& owner) {
        return std::any_of(patient_.bones.begin(), patient_.bones.end(),
                           [&](const CaseBone& bone) { return bone.segment == owner.name; });
      };
      const bool told = patient_.whole_spine && spine::find_level(segment.name) != nullptr;  // by the rig
      if (segment.parent < 0 || segment.boneless || told || owns(segment)) continue;
      int ancestor = segment.parent;
      while (ancestor > 0 && !owns(segments[static_cast<std::size_t>(ancestor)]))
        ancestor = segments[static_cast<std::size_t>(ancestor)].parent;
      add_finding(Severity::warning, segment.name, "no bone belongs to this segment", {},
                  "it will move with '" + segments[static_cast<std::size_t>(ancestor)].name +
                      "'; give it a bone if that is not meant");
    }
  }

  void check_volumes() {
    for (Misplaced& image : misplaced_images(patient_))
      add_finding(Severity::warning, image.name, image.what, image.at, image.mend);
    if (patient_.skin.F.rows() > 0 && patient_.labels) check_labels(*patient_.labels);
  }

  void check_labels(const CaseLabels& labels) {
    const auto used = label_ids(labels.image);
    std::int64_t absent = 0;
    std::string names;
    for (const auto& [id, name] : labels.table) {
      if (used.contains(id)) continue;
      if (absent++ < 5) names += (names.empty() ? "" : ", ") + std::to_string(id) + " '" + name + "'";
    }
    if (absent == 1)
      add_finding(Severity::warning, "labels", "no voxel has the id " + names, {},
                  "mend the table, or the image");
    if (absent > 1)
      add_finding(Severity::warning, "labels",
                  "no voxel has " + std::to_string(absent) + " of the table's " +
                      std::to_string(labels.table.size()) + " ids: " + names + (absent > 5 ? ", ..." : ""),
                  {}, "mend the table, or the image, unless they are not in this scan");
    std::int64_t unnamed = 0;
    std::string ids;
    std::optional<Vector3d> first;
    for (const auto& [id, use] : used) {
      if (labels.table.contains(id)) continue;
      if (unnamed++ < 10) ids += (ids.empty() ? "" : ", ") + std::to_string(id);
      if (!first) first = use.first;
    }
    if (unnamed > 0)
      add_finding(Severity::note, "labels",
                  plural(unnamed, "id") + " of the image " + (unnamed == 1 ? "is" : "are") +
                      " not in the table: " + ids + (unnamed > 10 ? ", ..." : ""),
                  first, "name them in the table, if they matter");
  }

  const Case& patient_;
  const Context& context_;
  const Options& options_;
  double skin_mm_ = 0;                // its largest extent
  std::optional<Inside> inside_;      // of the skin
  std::optional<InsideCells> cells_;  // of a closed one
  Report report_;
  std::vector<const SurfaceMesh*> meshes_;  // of report_.surfaces
  std::vector<SurfaceParts> parts_;
};

}  // namespace

Report inspect(const Case& patient, const Context& context, const Options& options) {
  return Inspector(patient, context, options).run();
}

}  // namespace ecorche::check
