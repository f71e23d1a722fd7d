// SPDX-License-Identifier: Apache-2.0
// How soon a body settles: bench_settle MODEL... --pose FILE... prints, for every model and pose, what is
// left of the distance between skinning and the converged solution of finite elements after so many steps,
// and the seconds that they took. "Left" is the root mean square over the free nodes of flesh, over that of
// skinning. The multigrid of the Laplacian is made once for a model and told by itself.
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <ecorche/io/case_file.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include "bench/table.hpp"
#include "preprocess/fem/reference.hpp"
#include "runtime/settle/settle_flesh.hpp"

namespace ecorche::bench {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double distance(const runtime::FleshSettler& settler, const std::vector<float>& nodes, const Points& solved) {
  double sum = 0;
  for (const std::int32_t n : settler.free_nodes())
    for (int c = 0; c < 3; ++c) {
      const double apart =
          static_cast<double>(nodes[3 * static_cast<std::size_t>(n) + static_cast<std::size_t>(c)]) -
          solved(n, c);
      sum += apart * apart;
    }
  return std::sqrt(sum / static_cast<double>(settler.free_nodes().size()));
}

void settle(const runtime::FleshSettler& settler, double multigrid_s, const runtime::BodyPoser& poser,
            const std::string& pose_file, const Table& table) {
  const Model& model = poser.model();
  runtime::PosedBody skinned = poser.make_frame();
  const Pose pose = io::read_pose(pose_file, model.rig);
  if (const Status status = poser.run(pose, runtime::Skinning::cor, poser.all_tissues(), skinned);
      !status.ok())
    throw Error(ErrorKind::data, pose_file, status.message, "mend the pose");
  fem::ReferenceOptions options;
  options.two_starts = false;
  options.settles = false;  // it is what settling is held against
  const fem::Reference solved = fem::solve_pose(model, skinned.pose, skinned.nodes, options, {});
  const std::string name = pose_file.substr(pose_file.find_last_of('/') + 1);
  if (!solved.converged()) {
    table.row({model.name, name, "finite elements do not converge"});
    return;
  }
  const double before = distance(settler, skinned.nodes, solved.nodes);
  for (const int steps : {1, 2, 4, 6, 8, 12, 16, 24, runtime::SettleOptions{}.most_steps}) {
    runtime::PosedBody body = skinned;
    const auto start = Clock::now();
    const runtime::Settled done = settler.run(body, {.most_steps = steps}, {});
    const double spent = seconds_since(start);
    table.row({std::to_string(model.tet_count()), name, fixed(multigrid_s, 1), std::to_string(done.steps),
               fixed(spent, 2), fixed(distance(settler, body.nodes, solved.nodes) / before, 3),
               fixed(distance(settler, body.nodes, solved.nodes), 3), fixed(before, 3)});
  }
}

int run(const std::vector<std::string>& words) {
  std::vector<std::string> models, poses;
  bool pose = false;
  for (const std::string& word : words) {
    if (word == "--pose") {
      pose = true;
    } else {
      (pose ? poses : models).push_back(word);
    }
  }
  const Table table({{"tets", 8},
                     {"pose", -20},
                     {"multigrid, s", 9},
                     {"steps", 5},
                     {"s", 6},
                     {"left", 6},
                     {"left, mm rms", 12},
                     {"skinned, mm rms", 15}});
  for (const std::string& file : models) {
    const auto model = std::make_shared<const Model>(model_file::read(file, {}));
    const runtime::BodyPoser poser(model);
    const auto start = Clock::now();
    const runtime::FleshSettler settler(*model, {});
    const double multigrid_s = seconds_since(start);
    for (const std::string& one : poses) settle(settler, multigrid_s, poser, one, table);
  }
  return 0;
}

}  // namespace
}  // namespace ecorche::bench

int main(int count, char** words) {
  try {
    return ecorche::bench::run({words + 1, words + count});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
