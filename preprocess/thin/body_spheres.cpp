// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/body_spheres.hpp"

#include "preprocess/thin/attach.hpp"
#include "preprocess/thin/distance.hpp"
#include "preprocess/thin/thinning.hpp"
#include "preprocess/thin/tree.hpp"

namespace ecorche::thin {

VolumetricSkeleton body_spheres(const Image& labels, const Skeleton& rig, double thinness,
                                const Context& context) {
  const Mask mask = segment(labels, {}, context);
  for (const std::string& joint : joints_outside(mask, rig))
    context.warn("joint " + joint + " lies outside the body (give its center in the skeleton)");
  VolumetricSkeleton body;
  {
    const DistanceMap map = distance_map(mask, DistanceMetric::euclidean, context);
    body = thin(map, mask.grid, thinness, context);
  }
  if (body.size() == 0)
    throw Error(ErrorKind::data, "--spheres", "no voxel is left at this thinness", "choose a lower one");
  body.name = "body";
  TreeOptions tree;
  tree.connect = true;
  body.parent = spanning_tree(body, tree, context);
  body.segment = attach(body, mask, rig, context).segment;
  return body;
}

}  // namespace ecorche::thin
