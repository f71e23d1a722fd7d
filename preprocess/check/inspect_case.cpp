// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/inspect_case.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "preprocess/check/inside.hpp"
#include "preprocess/geometry/face_tree.hpp"

namespace ecorche::check {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

// A person's skin is between a finger and a giant; anything else is in another unit.
constexpr double kSmallestSkin = 20, kLargestSkin = 3000;

std::string plural(std::int64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

std::string rounded(double x) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", x);
  return text.data();
}

AlignedBox3d bounds(const SurfaceFigures& figures) {
  return {figures.low, figures.high};
}

AlignedBox3d bounds(const ImageGrid& grid) {
  AlignedBox3d box;
  for (int corner = 0; corner < 8; ++corner) {
    std::array<double, 3> index{};
    for (std::size_t k = 0; k < 3; ++k) index[k] = (corner >> k & 1) != 0 ? grid.size[k] - 0.5 : -0.5;
    const auto p = grid.point(index[0], index[1], index[2]);
    box.extend(Vector3d(p[0], p[1], p[2]));
  }
  return box;
}

class Inspector {
 public:
  Inspector(const Case& patient, const Context& context) : patient_(patient), context_(context) {}

  Report run() {
    const double steps =
        2.0 * static_cast<double>(patient_.bones.size()) + static_cast<double>(patient_.tissues.size()) + 1;
    auto step = [&, done = 0]() mutable {
      context_.check_stop();
      context_.report(++done / steps);
    };
    add(patient_.skin_name, Group::skin, patient_.skin);
    step();
    check_skin();
    for (const CaseBone& bone : patient_.bones) add(bone.name, Group::bone, bone.surface), step();
    for (const CaseTissue& tissue : patient_.tissues) add(tissue.name, tissue.group, tissue.surface), step();
    if (patient_.bones.empty())
      tell(Severity::error, "bones", "there is none", {}, "a case needs at least one bone");
    if (patient_.skin.F.rows() > 0) {
      check_places();
      check_bones(step);
    }
    check_segments();
    check_volumes();
    return std::move(report_);
  }

 private:
  void tell(Severity severity, std::string where, std::string what, const std::optional<Vector3d>& at,
            std::string mend) {
    report_.findings.push_back({severity, std::move(where), std::move(what), at, std::move(mend)});
  }

  // One surface by itself. Only skin and bones are filled when a body is prepared: faults of the rest do no
  // harm.
  void add(const std::string& name, Group group, const SurfaceMesh& mesh) {
    const SurfaceFigures figures = measure(mesh);
    const Severity harm = group == Group::skin || group == Group::bone ? Severity::warning : Severity::note;
    const auto tell_of = [&](const Offenders& offenders, Severity severity, const std::string& noun,
                             const std::string& mend) {
      if (offenders.count > 0) tell(severity, name, plural(offenders.count, noun), offenders.first, mend);
    };
    if (figures.triangles == 0)
      tell(group == Group::skin ? Severity::error : harm, name, "has no triangle", {}, "export it again");
    tell_of(figures.open, harm, "open edge", "close its holes");
    tell_of(figures.nonmanifold, harm, "non-manifold edge", "let at most two triangles share an edge");
    tell_of(figures.flipped, harm, "inconsistently oriented edge", "orient all triangles outward");
    tell_of(figures.degenerate, Severity::note, "degenerate triangle", "remove it");
    if (figures.closed() && figures.triangles > 0 && figures.volume_mm3 < 0) {
      tell(harm, name, "is inside out: its volume is " + rounded(figures.volume_mm3 / 1000) + " ml", {},
           "flip its triangles, or mend the frame");
    }
    if (group == Group::skin && figures.components > 1) {
      tell(Severity::note, name, "has " + plural(figures.components, "part"), {},
           "keep the outer surface only");
    }
    report_.surfaces.push_back({name, group, figures, std::nullopt});
  }

  void check_skin() {
    const SurfaceFigures& skin = report_.surfaces.front().figures;
    if (skin.triangles == 0) return;
    const double extent = (skin.high - skin.low).maxCoeff();
    if (skin.closed() && !(std::abs(skin.volume_mm3) > 1e-6 * extent * extent * extent)) {
      tell(Severity::error, patient_.skin_name, "encloses no volume", {}, "export the skin again");
    }
    if (extent < kSmallestSkin || extent > kLargestSkin) {
      tell(Severity::warning, patient_.skin_name, "is " + rounded(extent) + " mm long", {},
           "mend the case's unit, if that is wrong");
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
      tell(Severity::warning, line.name, "lies wholly outside the skin's bounds", line.figures.low,
           "mend its frame or unit");
    }
    if (bones_away > 0 && bones_away == patient_.bones.size()) {
      tell(Severity::error, "bones", "all lie outside the skin's bounds", {},
           "mend the frame or unit of skin or bones");
    }
  }

  template <class Step>
  void check_bones(Step& step) {
    const Inside inside(patient_.skin);
    const geometry::FaceTree skin(patient_.skin);
    for (std::size_t b = 0; b < patient_.bones.size(); ++b) {
      check_bone(patient_.bones[b], inside, skin, report_.surfaces[b + 1]);
      step();
    }
  }

  void check_bone(const CaseBone& bone, const Inside& inside, const geometry::FaceTree& skin,
                  SurfaceLine& line) {
    BoneOutside out;
    std::int64_t count = 0;
    std::int32_t hint = -1;
    Vector3d farthest = Vector3d::Zero();
    for (Eigen::Index v = 0; v < bone.surface.V.rows(); ++v) {
      if (v % 4096 == 0) context_.check_stop();
      const Vector3d p = bone.surface.V.row(v).transpose();
      if (inside(p)) continue;
      const geometry::FaceTree::Hit hit = skin.nearest(p, hint);
      hint = hit.face;
      const double distance = std::sqrt(hit.squared);
      if (distance <= touching_mm) continue;
      ++count;
      if (distance > out.largest_mm) {
        out.largest_mm = distance;
        farthest = p;
      }
    }
    if (bone.surface.V.rows() > 0)
      out.share = static_cast<double>(count) / static_cast<double>(bone.surface.V.rows());
    line.outside = out;
    if (count == 0) return;
    tell(Severity::warning, bone.name,
         std::to_string(count) + (count == 1 ? " vertex (" : " vertices (") + rounded(100 * out.share) +
             " %) outside the skin, by up to " + rounded(out.largest_mm) + " mm",
         farthest, "the body will be skin and bones together; mend one of them if that is not meant");
  }

  void check_segments() {
    const auto& segments = patient_.skeleton.segments;
    for (const Segment& segment : segments) {
      const auto owns = [&](const Segment& owner) {
        return std::any_of(patient_.bones.begin(), patient_.bones.end(),
                           [&](const CaseBone& bone) { return bone.segment == owner.name; });
      };
      if (segment.parent < 0 || owns(segment)) continue;
      int ancestor = segment.parent;
      while (ancestor > 0 && !owns(segments[static_cast<std::size_t>(ancestor)]))
        ancestor = segments[static_cast<std::size_t>(ancestor)].parent;
      tell(Severity::warning, segment.name, "no bone belongs to this segment", {},
           "it will move with '" + segments[static_cast<std::size_t>(ancestor)].name +
               "'; give it a bone if that is not meant");
    }
  }

  void check_volumes() {
    if (patient_.skin.F.rows() == 0) return;
    const AlignedBox3d skin = bounds(report_.surfaces.front().figures);
    const auto check = [&](const std::string& name, const ImageGrid& grid) {
      const AlignedBox3d box = bounds(grid);
      if (!skin.intersects(box))
        tell(Severity::warning, name, "this volume and the skin do not meet", box.center(),
             "mend the skin's frame or unit, or the image's header");
    };
    for (const CaseVolume& volume : patient_.volumes) check(volume.name, volume.image.grid);
    if (patient_.labels) check("labels", patient_.labels->image.grid);
  }

  const Case& patient_;
  const Context& context_;
  Report report_;
};

}  // namespace

std::string_view severity_name(Severity severity) {
  switch (severity) {
    case Severity::note:
      return "note";
    case Severity::warning:
      return "warning";
    case Severity::error:
      break;
  }
  return "error";
}

bool Report::possible() const {
  return std::none_of(findings.begin(), findings.end(),
                      [](const Finding& f) { return f.severity == Severity::error; });
}

Report inspect(const Case& patient, const Context& context) {
  return Inspector(patient, context).run();
}

}  // namespace ecorche::check
