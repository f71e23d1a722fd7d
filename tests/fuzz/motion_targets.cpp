// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include <ecorche/values/error.hpp>
#include "io/motion/amc.hpp"
#include "io/motion/bvh.hpp"
#include "io/motion/gltf_clip.hpp"
#include "io/motion/table_file.hpp"
#include "tests/fuzz/promises.hpp"
#include "tests/fuzz/targets.hpp"

namespace ecorche::fuzz {
namespace {

constexpr std::size_t kFrames = 16;  // read of each clip, over its length

std::string text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

io::TextStream stream(std::string text) {
  return {std::make_unique<std::istringstream>(std::move(text)), "fuzzed"};
}

template <class Read>
void over(std::size_t frames, Read&& read) {
  must(frames > 0);
  for (std::size_t k = 0; k < std::min(frames, kFrames); ++k) read(frames - 1 - k * (frames / kFrames));
}

void look_at(io::ClipFile& clip) {
  const std::size_t joints = clip.head().joints.size();
  must(joints > 0 && clip.head().frame_seconds > 0);
  for (std::size_t j = 0; j < joints; ++j) {
    must(clip.head().joints[j].parent < static_cast<int>(j));
    must(clip.head().joints[j].offset.allFinite());
  }
  Eigen::Vector3d root;
  std::vector<Eigen::Quaterniond> turns(joints);
  over(clip.frames(), [&](std::size_t frame) {
    clip.read(frame, root, turns);
    must(root.allFinite());
    for (const Eigen::Quaterniond& q : turns) must(std::abs(q.norm() - 1) < 1e-6);
  });
}

// What is wrong in a file is said as such.
template <class Read>
void refused_or(Read&& read) {
  try {
    read();
  } catch (const Error& error) {
    must(error.kind() == ErrorKind::data);
  }
}

}  // namespace

void bvh(Bytes bytes) {
  refused_or([&] { look_at(*io::open_bvh(stream(text_of(bytes)), "fuzzed")); });
}

void acclaim(Bytes bytes) {
  const std::string both = text_of(bytes);
  const std::size_t cut = std::min(both.find('\0'), both.size());
  const std::string frames = cut < both.size() ? both.substr(cut + 1) : std::string();
  refused_or([&] { look_at(*io::open_amc(stream(frames), stream(both.substr(0, cut)), "fuzzed")); });
}

void gltf_clip(Bytes bytes) {
  refused_or([&] { look_at(*io::parse_gltf_clip(text_of(bytes), "fuzzed.gltf")); });
}

void angle_table(Bytes bytes) {
  refused_or([&] {
    io::AngleFile file(stream(text_of(bytes)));
    over(file.frames(), [&](std::size_t frame) {
      const auto row = file.read(frame);
      must(row.size() == file.columns().size());
      for (const double x : row) must(std::isfinite(x));
    });
  });
}

void marker_table(Bytes bytes) {
  refused_or([&] {
    io::MarkerFile file(stream(text_of(bytes)));
    over(file.frames(), [&](std::size_t frame) {
      const auto points = file.read(frame);
      must(points.size() == file.markers().size());
      for (const Eigen::Vector3d& p : points) must(p.allFinite() || p.hasNaN());
    });
  });
}

}  // namespace ecorche::fuzz
