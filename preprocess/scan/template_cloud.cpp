// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/template_cloud.hpp"

#include <numeric>

namespace ecorche::scan {

std::vector<SegmentCloud> segment_clouds(const BodyTemplate& body, const std::vector<std::uint8_t>& in_play) {
  std::vector<SegmentCloud> out(body.segments.size());
  for (std::size_t s = 0; s < out.size(); ++s) {
    if (in_play[s] == 0) continue;
    SegmentCloud& cloud = out[s];
    Eigen::Index count = 0;
    for (const TemplateBone& bone : body.bones)
      count += bone.segment == static_cast<int>(s) ? bone.points.rows() : 0;
    if (count == 0) continue;
    cloud.points.resize(count, 3);
    Eigen::Index row = 0;
    for (std::size_t b = 0; b < body.bones.size(); ++b) {
      const TemplateBone& bone = body.bones[b];
      if (bone.segment != static_cast<int>(s)) continue;
      cloud.points.middleRows(row, bone.points.rows()) = bone.points;
      row += bone.points.rows();
      cloud.bone.insert(cloud.bone.end(), static_cast<std::size_t>(bone.points.rows()), static_cast<int>(b));
    }
    cloud.centre = cloud.points.colwise().mean().transpose();
    cloud.radius =
        std::sqrt((cloud.points.rowwise() - cloud.centre.transpose()).rowwise().squaredNorm().maxCoeff());
    std::vector<std::int32_t> all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), 0);
    cloud.nearest = std::make_unique<geometry::NearestPoint>(cloud.points, all);
  }
  return out;
}

NearestBone nearest_bone(const std::vector<SegmentCloud>& clouds, const std::vector<Similarity>& placed,
                         const Eigen::Vector3d& p, double reach, int except) {
  NearestBone out;
  out.distance = reach;
  for (std::size_t s = 0; s < clouds.size(); ++s) {
    const SegmentCloud& cloud = clouds[s];
    if (!cloud.nearest || static_cast<int>(s) == except) continue;
    const Similarity& place = placed[s];
    if ((p - place(cloud.centre)).norm() - place.scale * cloud.radius >= out.distance) continue;
    double square = 0;
    const std::int32_t point = cloud.nearest->find(place.back(p), square);
    const double distance = place.scale * std::sqrt(square);
    if (distance >= out.distance) continue;
    out = {static_cast<int>(s), point, distance};
  }
  return out;
}

}  // namespace ecorche::scan
