// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/fit_rig.hpp"

#include <sstream>

#include "preprocess/rig/facing.hpp"
#include "preprocess/rig/present_part.hpp"
#include "preprocess/rig/sphere_fit.hpp"

namespace ecorche::rig {
namespace {

constexpr double kBadResidual = 0.10;  // of the radius
constexpr double kFewInliers = 0.5;

const SurfaceMesh& bone_surface(const Case& patient, const Joint& joint, const std::string& name) {
  for (const CaseBone& bone : patient.bones) {
    if (bone.name == name) return bone.surface;
  }
  throw Error(ErrorKind::config, "joint " + joint.name,
              "its sphere fit names bone '" + name + "', which the case has not",
              "add the bone, or give the joint's center as [x, y, z]");
}

void warn_bad(const JointFit& fit, const Context& context) {
  if (fit.residual_mm > kBadResidual * fit.radius_mm) {
    std::ostringstream line;
    line << "joint " << fit.joint << ": its surfaces are no good sphere: rms residual " << fit.residual_mm
         << " mm at radius " << fit.radius_mm << " mm, above 10 %";
    context.warn(line.str());
  }
  if (fit.inlier_share < kFewInliers) {
    std::ostringstream line;
    line << "joint " << fit.joint << ": only " << fit.inlier_share * 100 << " % of " << fit.points
         << " facing vertices lie on its sphere";
    context.warn(line.str());
  }
}

JointFit fit_center(const Case& patient, Joint& joint, const Context& context) {
  JointFit out;
  out.joint = joint.name;
  out.rule = joint.rule;
  if (joint.rule == CenterRule::given) return out;
  const SurfaceMesh& bone = bone_surface(patient, joint, joint.center_bone);
  const SurfaceMesh& facing = bone_surface(patient, joint, joint.facing_bone);
  const Points points = facing_vertices(bone, facing);
  const auto sphere = fit_sphere(points);
  if (!sphere) {
    throw Error(ErrorKind::data, "joint " + joint.name,
                std::to_string(points.rows()) + " vertices of " + joint.center_bone + " face " +
                    joint.facing_bone + " and lie on no sphere",
                "give the joint's center as [x, y, z]");
  }
  joint.center = sphere->center;
  out.radius_mm = sphere->radius;
  out.residual_mm = sphere->residual;
  out.inlier_share = sphere->inlier_share;
  out.points = static_cast<std::int32_t>(points.rows());
  warn_bad(out, context);
  return out;
}

}  // namespace

Rig fit(const Case& patient, const Context& context) {
  Rig rig;
  rig.skeleton = present_part(patient, context);
  for (Segment& segment : rig.skeleton.segments) {
    context.check_stop();
    rig.fits.push_back(fit_center(patient, segment.joint, context));
    context.report(static_cast<double>(rig.fits.size()) / static_cast<double>(rig.skeleton.segments.size()));
  }
  return rig;
}

}  // namespace ecorche::rig
