// SPDX-License-Identifier: Apache-2.0
// What does not need Unreal of clients/unreal, against a server: `watch ADDRESS`. Waits for a line of input
// and for a frame of a new pose after it.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <string>
#include <thread>

#include "EcorcheStream.h"

namespace {

double det(const float* a, const float* b, const float* c) {
  return a[0] * (double(b[1]) * c[2] - double(b[2]) * c[1]) -
         a[1] * (double(b[0]) * c[2] - double(b[2]) * c[0]) +
         a[2] * (double(b[0]) * c[1] - double(b[1]) * c[0]);
}

/// Of Unreal's normals, (p1 - p2) x (p0 - p2): outward ones give a negative sum of determinants in its
/// left-handed space.
double volume(const FEcorcheTissue& tissue) {
  double sum = 0;
  for (std::size_t i = 0; i < tissue.Triangles.size(); i += 3) {
    const auto corner = [&](std::size_t c) {
      return &tissue.Positions[3 * static_cast<std::size_t>(tissue.Triangles[i + c])];
    };
    sum -= det(corner(0), corner(1), corner(2)) / 6;
  }
  return sum;
}

/// Share of vertices' normals that point as Unreal's normal of a triangle there does.
double agreement(const FEcorcheTissue& tissue) {
  std::size_t agree = 0;
  for (std::size_t i = 0; i < tissue.Triangles.size(); i += 3) {
    const auto at = [&](std::size_t c) { return 3 * static_cast<std::size_t>(tissue.Triangles[i + c]); };
    double e[3], f[3];
    for (std::size_t k = 0; k < 3; ++k) {
      e[k] = tissue.Positions[at(1) + k] - tissue.Positions[at(2) + k];
      f[k] = tissue.Positions[at(0) + k] - tissue.Positions[at(2) + k];
    }
    const float* n = &tissue.Normals[at(0)];
    if ((e[1] * f[2] - e[2] * f[1]) * n[0] + (e[2] * f[0] - e[0] * f[2]) * n[1] +
            (e[0] * f[1] - e[1] * f[0]) * n[2] >
        0)
      ++agree;
  }
  return 3.0 * static_cast<double>(agree) / static_cast<double>(tissue.Triangles.size());
}

bool wait(FEcorcheStream& stream, std::uint64_t sequence) {
  const auto start = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - start < std::chrono::seconds(20)) {
    if (stream.Poll(0.01) && stream.PoseSequence() >= sequence) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  std::cout << "no frame: " << stream.Error() << '\n';
  return false;
}

}  // namespace

int main(int, char** words) {
  FEcorcheStream stream;
  if (!stream.Connect(words[1], "unreal")) {
    std::cout << stream.Error() << '\n';
    return 1;
  }
  if (stream.SetAngle("nose", "flexion", 1)) return 1;
  std::cout << stream.Error() << '\n';
  if (!stream.SetAngle("shoulder_left", "abduction", 1.4) || !stream.SendPose() || !wait(stream, 1)) return 1;
  const FEcorcheTissue& skin = stream.Tissues()[0];
  float low[3] = {1e9F, 1e9F, 1e9F}, high[3] = {-1e9F, -1e9F, -1e9F};
  for (std::size_t i = 0; i < skin.Positions.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], skin.Positions[i]);
    high[i % 3] = std::max(high[i % 3], skin.Positions[i]);
  }
  const float middle[3] = {0, 0, 100};
  std::int32_t tissue = -1;
  if (!stream.Probe(middle, tissue)) return 1;
  std::cout << "left to " << low[1] << " right to " << high[1] << " high " << high[2] << " litres "
            << volume(skin) / 1000 << " agree " << agreement(skin) << " in "
            << (tissue < 0 ? "nothing" : stream.Tissues()[static_cast<std::size_t>(tissue)].Name)
            << std::endl;
  std::string line;
  std::getline(std::cin, line);
  // The line was cut and mended: it comes back by itself.
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  stream.Poll(0.01);
  if (!wait(stream, 1) || !stream.SetAngle("elbow_left", "flexion", 1) || !stream.SendPose() ||
      !wait(stream, 2))
    return 1;
  std::cout << "back\n";
  return 0;
}
