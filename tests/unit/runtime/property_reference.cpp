// SPDX-License-Identifier: Apache-2.0
// Skinning against plain double precision over a clip: on the weights that the run time keeps, and on all
// stored.
#include <cstdio>

#include <ecorche/kinematics/forward.hpp>
#include "tests/unit/runtime/prepared_body.hpp"

namespace ecorche::runtime {
namespace {

TEST(Reference, WholeClip) {
  std::printf("%-24s %-4s %8s %18s %18s\n", "model", "", "frames", "kept weights mm", "all weights mm");
  for (const std::string& path : test::model_paths()) {
    const auto model = test::read_model(path);
    const BodyPoser poser(model);
    PosedBody body = poser.make_frame();
    const auto poses = test::walk(*model, test::frame_step(model->node_count(), 20'000'000));
    for (const Skinning skinning : test::all_skinnings) {
      double kept = 0, stored = 0;
      for (const Pose& pose : poses) {
        ASSERT_TRUE(poser.run(pose, skinning, {}, body).ok());
        kept = std::max(
            kept, test::farthest(body.nodes, test::reference_nodes(*model, body.segments, skinning, 1e-4)));
        stored = std::max(
            stored, test::farthest(body.nodes, test::reference_nodes(*model, body.segments, skinning, 0)));
      }
      std::printf("%-24s %-4s %8zu %18.5f %18.5f\n", test::short_name(path).c_str(),
                  std::string(skinning_name(skinning)).c_str(), poses.size(), kept, stored);
      EXPECT_LE(kept, 0.05);
      EXPECT_LE(stored, 0.1);
    }
  }
}

}  // namespace
}  // namespace ecorche::runtime
