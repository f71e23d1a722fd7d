// SPDX-License-Identifier: Apache-2.0
// Volumes posed in one pass against locate() and resample(), and the latter against exhaustive search
// (volume_test).
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <memory>
#include <random>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include "runtime/volume/fixed_points.hpp"
#include "runtime/volume/sample_batch.hpp"
#include "runtime/volume/sampler.hpp"
#include "tests/support/instruction_sets.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

std::vector<float> flexed_nodes(const std::shared_ptr<const Model>& model, double flexion) {
  const BodyPoser poser(model);
  PosedBody body = poser.make_frame();
  Pose pose = Pose::rest(3);
  pose.rotation[1] = Eigen::AngleAxisd(flexion, Vector3d::UnitX());
  pose.rotation[2] = Eigen::AngleAxisd(0.6, Vector3d::UnitZ());
  EXPECT_TRUE(poser.run(pose, Skinning::cor, {}, body).ok());
  return body.nodes;
}

std::vector<float> nodes_at_rest(const Model& model) {
  return {model.nodes.data(), model.nodes.data() + model.nodes.size()};
}

// Turned, anisotropic, of either hand; `finer` times as many voxels along each axis.
ImageGrid skewed_grid(bool left_handed, int finer = 1) {
  ImageGrid grid;
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> direction =
      Eigen::Quaterniond(0.9, 0.2, -0.3, 0.1).normalized().toRotationMatrix();
  if (left_handed) direction.col(2) *= -1;
  std::copy_n(direction.data(), 9, grid.direction.begin());
  grid.spacing = {7.0 / finer, 9.0 / finer, 12.0 / finer};
  const Vector3d low = direction * Vector3d(-90, -90, left_handed ? -330 : -40);
  grid.origin = {low.x(), low.y(), low.z()};
  grid.size = {50 * finer, 38 * finer, 34 * finer};
  return grid;
}

// A smooth volume around the toy body: values stay apart by less than a step per hundredth of a voxel.
template <class T>
ModelVolume smooth_volume(const ImageGrid& grid, int components = 1) {
  ModelVolume volume;
  volume.image = Image(grid, scalar_type_of<T>, components);
  const auto values = volume.image.scalars<T>();
  for (std::size_t v = 0; v < values.size(); ++v) {
    const std::size_t voxel = v / static_cast<std::size_t>(components),
                      nx = static_cast<std::size_t>(grid.size[0]);
    const auto row = voxel / nx;
    const double i = static_cast<double>(voxel % nx), rest = static_cast<double>(row);
    values[v] = static_cast<T>(60 + 30 * std::sin(0.2 * i) + 20 * std::cos(0.003 * rest) +
                               static_cast<double>(v % static_cast<std::size_t>(components)));
  }
  volume.background = 7;
  return volume;
}

// The voxels where both differ by more than `most`, over those that some tet holds.
template <class T>
double differing(const Model& model, std::span<const float> nodes, const ModelVolume& volume,
                 Sampling sampling, const Image& posed, double most) {
  InverseMap map;
  locate(model, nodes, posed.grid, map);
  const Image slow = resample(model, nodes, map, volume, sampling);
  const auto a = slow.scalars<T>(), b = posed.scalars<T>();
  std::size_t differ = 0, held = 0;
  for (std::size_t v = 0; v < a.size(); ++v) {
    held += map.tet[v / static_cast<std::size_t>(posed.components)] != InverseMap::none;
    differ += std::abs(static_cast<double>(a[v]) - static_cast<double>(b[v])) > most;
  }
  EXPECT_GT(held, 400u);
  return static_cast<double>(differ) / static_cast<double>(held);
}

class PosedInOnePass : public testing::Test {
 protected:
  PosedInOnePass() : model(std::make_shared<const Model>(test::toy_model())), poser(model) {}

  template <class T>
  void expect_slow_twin(const ModelVolume& volume, Sampling sampling, const ImageGrid& grid, double most) {
    for (const double flexion : {0.0, 1.2, 2.9}) {
      SCOPED_TRACE(flexion);
      const std::vector<float> nodes = flexed_nodes(model, flexion);
      poser.pose(nodes, volume, sampling, grid, out, scratch);
      // Ties and faces: a voxel in a thousand may go the other way.
      EXPECT_LE((differing<T>(*model, nodes, volume, sampling, out, most)), 1e-3);
    }
  }

  std::shared_ptr<const Model> model;
  VolumePoser poser;
  VolumePoser::Scratch scratch;
  Image out;
};

TEST_F(PosedInOnePass, AgreesWithTheSlowTwinOnEveryInstructionSet) {
  test::for_instruction_sets([&] {
    for (const bool left_handed : {false, true}) {
      const ImageGrid grid = skewed_grid(left_handed);
      expect_slow_twin<std::uint8_t>(smooth_volume<std::uint8_t>(grid), Sampling::nearest, grid, 0);
      expect_slow_twin<std::uint8_t>(smooth_volume<std::uint8_t>(grid), Sampling::trilinear, grid, 1);
      expect_slow_twin<std::int16_t>(smooth_volume<std::int16_t>(grid), Sampling::trilinear, grid, 1);
      expect_slow_twin<std::uint16_t>(smooth_volume<std::uint16_t>(grid), Sampling::trilinear,
                                      skewed_grid(!left_handed), 1);
    }
  });
}

TEST_F(PosedInOnePass, AgreesForFloatsAndSeveralComponents) {
  const ImageGrid grid = skewed_grid(false);
  expect_slow_twin<float>(smooth_volume<float>(grid), Sampling::trilinear, grid, 1e-2);
  expect_slow_twin<std::uint8_t>(smooth_volume<std::uint8_t>(grid, 3), Sampling::trilinear, grid, 1);
  expect_slow_twin<std::int32_t>(smooth_volume<std::int32_t>(grid, 2), Sampling::nearest, grid, 0);
}

TEST_F(PosedInOnePass, FinerAndCoarserGridsAndTheirParts) {
  const ModelVolume volume = smooth_volume<std::uint8_t>(skewed_grid(false));
  // A third, not a half: no place of the part at rest lies half way between two voxels.
  expect_slow_twin<std::uint8_t>(volume, Sampling::nearest, skewed_grid(false, 3), 0);
  const std::vector<float> nodes = flexed_nodes(model, 1.2);
  const ImageGrid whole = skewed_grid(false, 2);
  Image all, part;
  poser.pose(nodes, volume, Sampling::trilinear, whole, all, scratch);
  std::size_t differ = 0, other = 0;
  std::mt19937 random(11);
  for (int region = 0; region < 300; ++region) {
    // The first is large; the others are where only some blocks of tets reach.
    std::array<std::int32_t, 3> first{17, 9, 21}, size{31, 29, 24};
    for (std::size_t a = 0; a < 3 && region > 0; ++a) {
      size[a] = 2 + static_cast<std::int32_t>(random() % 7U);
      first[a] = static_cast<std::int32_t>(random() % static_cast<unsigned>(whole.size[a] - size[a]));
    }
    ImageGrid roi = whole;
    roi.origin = whole.point(first[0], first[1], first[2]);
    roi.size = size;
    poser.pose(nodes, volume, Sampling::trilinear, roi, part, scratch);
    for (std::size_t v = 0; v < roi.voxels(); ++v) {
      const auto at = static_cast<std::int32_t>(v);
      const std::int32_t i = at % size[0], j = at / size[0] % size[1], k = at / size[0] / size[1];
      const auto a = all.scalars<std::uint8_t>()[whole.offset(i + first[0], j + first[1], k + first[2])];
      const auto b = part.scalars<std::uint8_t>()[v];
      differ += std::abs(a - b) > 1;
      other += b != 7;
    }
  }
  EXPECT_GT(other, 400u);
  EXPECT_EQ(differ, 0u);
}

TEST_F(PosedInOnePass, SlicePlanes) {
  const ModelVolume volume = smooth_volume<std::uint8_t>(skewed_grid(false));
  const std::vector<float> nodes = flexed_nodes(model, 1.2);
  ImageGrid slice = skewed_grid(true, 5);
  slice.origin = slice.point(0, 0, 78.5);
  slice.size[2] = 1;
  poser.pose(nodes, volume, Sampling::nearest, slice, out, scratch);
  EXPECT_LE((differing<std::uint8_t>(*model, nodes, volume, Sampling::nearest, out, 0)), 1e-3);
}

TEST_F(PosedInOnePass, RestGivesEveryVoxelBack) {
  const ImageGrid grid = skewed_grid(false);
  std::mt19937 random(3);
  ModelVolume volume = smooth_volume<std::uint16_t>(grid);
  for (auto& value : volume.image.scalars<std::uint16_t>()) value = static_cast<std::uint16_t>(random());
  volume.background = 0;
  const std::vector<float> nodes = nodes_at_rest(*model);
  InverseMap map;
  locate(*model, nodes, grid, map);
  test::for_instruction_sets([&] {
    for (const Sampling sampling : {Sampling::nearest, Sampling::trilinear}) {
      poser.pose(nodes, volume, sampling, grid, out, scratch);
      std::size_t wrong = 0, held = 0;
      for (std::size_t v = 0; v < map.tet.size(); ++v) {
        if (map.tet[v] == InverseMap::none) continue;
        ++held;
        wrong += out.scalars<std::uint16_t>()[v] != volume.image.scalars<std::uint16_t>()[v];
      }
      EXPECT_GT(held, 400u);
      EXPECT_EQ(wrong, 0u);
    }
  });
}

TEST_F(PosedInOnePass, WhereTetsFoldTheLowestPositiveOneWins) {
  // Two copies of one tet with other rest places, and an inverted one before them.
  Model folded;
  folded.nodes.resize(12, 3);
  folded.nodes << 0, 0, 0, 40, 0, 0, 0, 40, 0, 0, 0, 40,  //
      100, 0, 0, 140, 0, 0, 100, 40, 0, 100, 0, 40,       //
      200, 0, 0, 240, 0, 0, 200, 40, 0, 200, 0, 40;
  folded.tets.resize(3, 4);
  folded.tets << 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11;
  std::vector<float> nodes = nodes_at_rest(folded);
  for (std::size_t n = 0; n < 12; ++n) {
    const std::size_t tet = n / 4;
    nodes[3 * n] -= 100 * static_cast<float>(tet);
  }
  for (std::size_t c = 0; c < 3; ++c)
    std::swap(nodes[3 + c], nodes[6 + c]);  // tet 0 lies the wrong way round
  ModelVolume volume;
  volume.image = Image(ImageGrid{{260, 60, 60}, {-10, -10, -10}, {1, 1, 1}}, ScalarType::u8);
  for (std::size_t v = 0; v < volume.image.bytes.size(); ++v) {
    volume.image.bytes[v] = static_cast<std::byte>(1 + (v % 260 > 90) + (v % 260 > 190));
  }
  const auto posed = [&](int i, int j, int k) {
    const Image image = pose_volume(std::make_shared<const Model>(folded), nodes, volume, Sampling::nearest,
                                    ImageGrid{{60, 60, 60}, {-10, -10, -10}, {1, 1, 1}});
    return static_cast<int>(image.bytes[image.grid.offset(i, j, k)]);
  };
  EXPECT_EQ(posed(15, 15, 15), 2);
  EXPECT_EQ(posed(45, 12, 12), 2);
  EXPECT_EQ(posed(55, 55, 55), 0);
  // All three the wrong way round: the lowest.
  for (std::size_t n : {4U, 8U}) std::swap_ranges(&nodes[3 * n + 3], &nodes[3 * n + 6], &nodes[3 * n + 6]);
  EXPECT_EQ(posed(15, 15, 15), 1);
}

TEST_F(PosedInOnePass, WhereManyTetsPileUpTheLowestPositiveOneWins) {
  // More than a block of them on one place, each from values of its own: within a vector, a run and a block.
  constexpr int count = 130;
  Model pile;
  pile.nodes.resize(4 * count, 3);
  pile.tets.resize(count, 4);
  ModelVolume volume;
  volume.image = Image({{10 * count, 9, 9}}, ScalarType::i16);
  const std::span<std::int16_t> values = volume.image.scalars<std::int16_t>();
  for (std::size_t v = 0; v < values.size(); ++v) values[v] = static_cast<std::int16_t>(v % 1300 / 10 + 1);
  for (int t = 0; t < count; ++t) {
    const auto x = static_cast<float>(10 * t);
    pile.nodes.middleRows(4 * t, 4) << x, 0, 0, x + 8, 0, 0, x, 8, 0, x, 0, 8;
    pile.tets.row(t) << 4 * t, 4 * t + 1, 4 * t + 2, 4 * t + 3;
  }
  pile.tet_label.assign(count, 1);
  const VolumePoser of(std::make_shared<const Model>(pile));
  const ImageGrid grid{{9, 9, 9}};
  test::for_instruction_sets([&] {
    for (const std::size_t positive : {0U, 3U, 19U, 70U, 129U}) {
      std::vector<float> nodes = nodes_at_rest(pile);
      for (std::size_t n = 0; n < 4 * count; ++n) {
        const std::size_t tet = n / 4;
        nodes[3 * n] -= static_cast<float>(10 * tet);
      }
      for (std::size_t t = 0; t < positive; ++t)
        std::swap_ranges(&nodes[12 * t], &nodes[12 * t + 3], &nodes[12 * t + 3]);
      Image posed;
      VolumePoser::Scratch own;
      of.pose(nodes, volume, Sampling::nearest, grid, posed, own);
      const std::span<const std::int16_t> got = std::as_const(posed).scalars<std::int16_t>();
      const auto held = std::count(got.begin(), got.end(), static_cast<std::int16_t>(positive + 1));
      EXPECT_GT(held, 100) << positive;
      EXPECT_EQ(held + std::count(got.begin(), got.end(), std::int16_t{0}), 729) << positive;
    }
  });
}

TEST_F(PosedInOnePass, ACrumpledBodyInBoxesOfAllSizes) {
  // Every third tet or so lies the wrong way round, in more places than are told apart.
  std::vector<float> nodes = nodes_at_rest(*model);
  std::mt19937 random(5);
  for (float& x : nodes) x += static_cast<float>(random() % 4001) * 0.01F - 20;
  const ModelVolume volume = smooth_volume<std::uint8_t>(skewed_grid(false));
  test::for_instruction_sets([&] {
    for (const bool left_handed : {false, true}) {
      for (const int finer : {1, 2, 4}) {
        SCOPED_TRACE(finer);
        ImageGrid grid = skewed_grid(left_handed, finer);
        poser.pose(nodes, volume, Sampling::nearest, grid, out, scratch);
        EXPECT_LE((differing<std::uint8_t>(*model, nodes, volume, Sampling::nearest, out, 0)), 1e-3);
        if (finer < 4) continue;  // too few voxels in a slice to count
        grid.origin = grid.point(0, 0, 17 * finer);
        grid.size[2] = 1;
        poser.pose(nodes, volume, Sampling::nearest, grid, out, scratch);
        EXPECT_LE((differing<std::uint8_t>(*model, nodes, volume, Sampling::nearest, out, 0)), 2e-3);
      }
    }
  });
}

TEST_F(PosedInOnePass, FlatTetsAndNodesThatAreNoNumbersDoNoHarm) {
  const ModelVolume volume = smooth_volume<std::uint8_t>(skewed_grid(false));
  // A sheet a hundredth of a millimetre thick, on voxel centres.
  const ImageGrid grid{{21, 60, 100}, {-10, -90, -40}, {1, 3, 4}};
  std::vector<float> nodes = nodes_at_rest(*model);
  for (std::size_t n = 0; n < nodes.size(); n += 3) nodes[n] *= 1e-4F;
  poser.pose(nodes, volume, Sampling::trilinear, grid, out, scratch);
  EXPECT_LE((differing<std::uint8_t>(*model, nodes, volume, Sampling::trilinear, out, 1)), 1e-3);
  nodes[30] = std::numeric_limits<float>::quiet_NaN();
  nodes[61] = std::numeric_limits<float>::infinity();
  poser.pose(nodes, volume, Sampling::trilinear, skewed_grid(false), out, scratch);
}

TEST_F(PosedInOnePass, SameBytesForAnyNumberOfThreads) {
  const ModelVolume volume = smooth_volume<std::uint8_t>(skewed_grid(false));
  const std::vector<float> nodes = flexed_nodes(model, 2.9);
  Image one, four;
  tbb::task_arena(1).execute(
      [&] { one = pose_volume(model, nodes, volume, Sampling::trilinear, skewed_grid(false, 2)); });
  tbb::task_arena(4).execute(
      [&] { four = pose_volume(model, nodes, volume, Sampling::trilinear, skewed_grid(false, 2)); });
  EXPECT_EQ(one.bytes, four.bytes);
}

TEST_F(PosedInOnePass, RefusesAGridOfNothingOrTooMuch) {
  const ModelVolume volume = smooth_volume<std::uint8_t>(skewed_grid(false));
  ImageGrid grid = skewed_grid(false);
  grid.size = {2000, 2000, 2000};
  EXPECT_THROW(poser.pose(nodes_at_rest(*model), volume, Sampling::nearest, grid, out, scratch), Error);
  grid.size = {0, 4, 4};
  EXPECT_THROW(poser.pose(nodes_at_rest(*model), volume, Sampling::nearest, grid, out, scratch), Error);
}

// Places all over an image and beyond it, many of them just beside a tie.
template <class T>
void expect_samplers_nearest(std::size_t count) {
  ModelVolume volume = smooth_volume<T>(ImageGrid{{9, 7, 5}});
  volume.background = 9;
  Image posed(ImageGrid{{static_cast<std::int32_t>(count), 1, 1}}, scalar_type_of<T>);
  std::mt19937 random(static_cast<unsigned>(count));
  VoxelBatch batch;
  batch.count = count;
  const float ties[] = {0,      0.5F, std::nextafter(0.5F, 0.0F), std::nextafter(0.5F, 1.0F), -0.5F,
                        -1e-9F, 0.25F};
  for (std::size_t i = 0; i < count; ++i) {
    batch.offset[i] = static_cast<std::uint32_t>(count - 1 - i);
    for (std::size_t a = 0; a < 3; ++a) {
      batch.base[a][i] = static_cast<std::int32_t>(random() % 11) - 2;
      batch.part[a][i] = static_cast<float>(random() % 3) + ties[random() % std::size(ties)];
    }
  }
  const SampleJob job{volume.image, volume.background, posed};
  const BatchSink sink = sink_for(job, Sampling::nearest);
  sink.sample(sink.to, batch);
  const Sampler<T> slow{volume.image.grid, volume.image.scalars<T>(), 1, volume.background};
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = [&](std::size_t a) { return batch.base[a][i] + static_cast<double>(batch.part[a][i]); };
    T expected = 9;
    slow.nearest(at(0), at(1), at(2), &expected);
    ASSERT_EQ(posed.scalars<T>()[count - 1 - i], expected) << i << " of " << count;
  }
}

TEST(NearestSamples, AreTheSamplersToTheByteOnEveryInstructionSet) {
  test::for_instruction_sets([] {
    for (const std::size_t count : {std::size_t{1}, std::size_t{3}, std::size_t{16}, std::size_t{17},
                                    std::size_t{100}, VoxelBatch::capacity}) {
      expect_samplers_nearest<std::uint8_t>(count);
      expect_samplers_nearest<std::int8_t>(count);
      expect_samplers_nearest<std::uint16_t>(count);
      expect_samplers_nearest<std::int32_t>(count);
      expect_samplers_nearest<float>(count);
      expect_samplers_nearest<double>(count);
    }
  });
}

TEST(FixedPoints, DifferencesOfTwoAlwaysFit) {
  for (const double reach : {0.0, 1.0, 511.0, 513.0, 1e4, 6e5, 1e30}) {
    const int bits = fraction_bits(reach);
    EXPECT_LE(bits, 20);
    EXPECT_GE(bits, 10);
    EXPECT_LE(std::ldexp(std::min(reach, 524288.0), bits), 1073741824.0) << reach;
  }
}

}  // namespace
}  // namespace ecorche::runtime
