// SPDX-License-Identifier: Apache-2.0
// pose MODEL.hdf JOINT ANGLE DEGREES: how far the farthest vertex of the skin moves, and the verdict.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ecorche/kinematics/named_angles.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/version.hpp>
#include <memory>
#include <numbers>

int main(int, char** argv) try {
  using namespace ecorche;
  const auto model = std::make_shared<const Model>(model_file::read(argv[1], Context{}));
  const Skeleton& skeleton = model->rig.skeleton;
  const auto angle = kinematics::find_named_angle(skeleton, argv[2], argv[3]);
  if (!angle) throw Error(ErrorKind::usage, argv[1], "has no such joint or angle", "see ecorche info");
  const Pose pose = kinematics::pose_of(skeleton, {{*angle, std::atof(argv[4]) * std::numbers::pi / 180}});

  const runtime::BodyPoser poser(model);
  runtime::PosedBody rest = poser.make_frame(), posed = poser.make_frame();
  const Status at_rest =
      poser.run(kinematics::pose_of(skeleton, {}), runtime::Skinning::cor, poser.all_tissues(), rest);
  const Status moved = poser.run(pose, runtime::Skinning::cor, poser.all_tissues(), posed);
  if (!at_rest.ok() || !moved.ok()) return 1;

  double farthest = 0;
  for (std::size_t v = 0; v < rest.tissues[0].size(); v += 3) {
    farthest = std::max<double>(farthest, std::hypot(posed.tissues[0][v] - rest.tissues[0][v],
                                                     posed.tissues[0][v + 1] - rest.tissues[0][v + 1],
                                                     posed.tissues[0][v + 2] - rest.tissues[0][v + 2]));
  }
  const bool pass = runtime::measure(*model, posed, poser.all_tissues()).pass;
  std::printf("ecorche %s: %.1f mm, %s\n", ECORCHE_VERSION, farthest, pass ? "pass" : "warn");
  return 0;
} catch (const ecorche::Error& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 1;
}
