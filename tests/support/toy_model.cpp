// SPDX-License-Identifier: Apache-2.0
#include "tests/support/toy_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace ecorche::test {
namespace {

constexpr int kCells[3] = {2, 2, 18};
constexpr double kSide = 40, kLength = 300, kBlend = 40;

// Kuhn's six tets of every cell, all around the diagonal from (0,0,0) to (1,1,1): neighbours fit without a
// rule.
void make_mesh(Model& model) {
  const auto node = [](int i, int j, int k) { return i + (kCells[0] + 1) * (j + (kCells[1] + 1) * k); };
  model.nodes.resize(node(kCells[0], kCells[1], kCells[2]) + 1, 3);
  for (int k = 0; k <= kCells[2]; ++k) {
    for (int j = 0; j <= kCells[1]; ++j) {
      for (int i = 0; i <= kCells[0]; ++i) {
        model.nodes.row(node(i, j, k)) << static_cast<float>(kSide * i / kCells[0] - kSide / 2),
            static_cast<float>(kSide * j / kCells[1] - kSide / 2),
            static_cast<float>(kLength * k / kCells[2]);
      }
    }
  }
  std::vector<std::array<int, 4>> tets;
  std::array<int, 3> axes{0, 1, 2};
  for (int k = 0; k < kCells[2]; ++k) {
    for (int j = 0; j < kCells[1]; ++j) {
      for (int i = 0; i < kCells[0]; ++i) {
        std::sort(axes.begin(), axes.end());
        do {
          std::array<int, 3> at{i, j, k};
          std::array<int, 4> tet{node(i, j, k), 0, 0, 0};
          for (std::size_t step = 0; step < 3; ++step) {
            ++at[static_cast<std::size_t>(axes[step])];
            tet[step + 1] = node(at[0], at[1], at[2]);
          }
          const auto row = [&](std::size_t c) { return model.nodes.row(tet[c]); };
          if (tet_det(row(0), row(1), row(2), row(3)) < 0) std::swap(tet[2], tet[3]);
          tets.push_back(tet);
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
    }
  }
  model.tets.resize(static_cast<Eigen::Index>(tets.size()), 4);
  model.tet_label.assign(tets.size(), TetMesh::soft);
  for (std::size_t t = 0; t < tets.size(); ++t) {
    for (int c = 0; c < 4; ++c)
      model.tets(static_cast<Eigen::Index>(t), c) = tets[t][static_cast<std::size_t>(c)];
  }
}

void make_rig(Model& model) {
  const std::array<std::string, 3> names{"base", "middle", "tip"};
  for (int s = 0; s < 3; ++s) {
    Segment segment;
    segment.name = names[static_cast<std::size_t>(s)];
    segment.parent = s - 1;
    segment.joint.name = segment.name + "_joint";
    segment.joint.kind = s == 1 ? JointKind::hinge : JointKind::ball;
    segment.joint.center = {0, 0, 100.0 * s};
    segment.joint.sequence = {{"flexion", 0, 1, 0, -2.5, 2.5}, {"tilt", 1, 1, 0}, {"twist", 2, 1, 0}};
    segment.joint.limits_source = "toy";
    segment.aliases = {"Toy" + std::to_string(s)};
    model.rig.skeleton.segments.push_back(segment);
    model.rig.fits.push_back({segment.joint.name, CenterRule::given, 0, 0, 1, 0});
  }
  model.rig.skeleton.name = "toy";
}

void make_weights(Model& model) {
  model.weights.offsets = {0};
  for (Eigen::Index n = 0; n < model.nodes.rows(); ++n) {
    const double z = static_cast<double>(model.nodes(n, 2));
    const auto past = [&](double joint) { return std::clamp((z - joint) / kBlend + 0.5, 0.0, 1.0); };
    const double above1 = past(100), above2 = past(200);
    const std::array<double, 3> w{1 - above1, above1 - above2, above2};
    for (std::uint16_t s = 0; s < 3; ++s) {
      if (w[s] < 1e-6) continue;
      model.weights.segment.push_back(s);
      model.weights.weight.push_back(static_cast<float>(w[s]));
    }
    model.weights.offsets.push_back(model.weights.segment.size());
  }
}

std::array<double, 3> dense_row(const Weights& weights, std::size_t node) {
  std::array<double, 3> row{0, 0, 0};
  for (std::size_t e = weights.offsets[node]; e < weights.offsets[node + 1]; ++e) {
    row[weights.segment[e]] = static_cast<double>(weights.weight[e]);
  }
  return row;
}

// The sum of Sujar18 eqs. 6-7 as it is written.
void make_centres(Model& model) {
  const double sigma = model.cor.sigma = 0.05;
  model.cor.centre = model.nodes;
  model.cor.has_centre.assign(model.node_count(), 0);
  for (std::size_t p = 0; p < model.node_count(); ++p) {
    const auto wp = dense_row(model.weights, p);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double mass = 0;
    for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
      std::array<double, 3> wt{0, 0, 0};
      Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
      for (int c = 0; c < 4; ++c) {
        const auto row = dense_row(model.weights, static_cast<std::size_t>(model.tets(t, c)));
        for (std::size_t s = 0; s < 3; ++s) wt[s] += row[s] / 4;
        centroid += model.nodes.row(model.tets(t, c)).cast<double>().transpose() / 4;
      }
      const double volume = tet_det(model.nodes.row(model.tets(t, 0)), model.nodes.row(model.tets(t, 1)),
                                    model.nodes.row(model.tets(t, 2)), model.nodes.row(model.tets(t, 3))) /
                            6;
      double similarity = 0;
      for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t k = 0; k < 3; ++k) {
          if (j == k) continue;
          const double cross = wp[j] * wt[k] - wp[k] * wt[j];
          similarity += wp[j] * wp[k] * wt[j] * wt[k] * std::exp(-cross * cross / (sigma * sigma));
        }
      }
      sum += similarity * volume * centroid;
      mass += similarity * volume;
    }
    if (mass < 1e-9) continue;
    model.cor.has_centre[p] = 1;
    model.cor.centre.row(static_cast<Eigen::Index>(p)) = (sum / mass).cast<float>().transpose();
  }
}

// A closed tube of square rings about the z axis.
void make_tube(double half, double from, double to, int rings, PointsF& V, Triangles& F) {
  V.resize(4 * rings + 2, 3);
  for (int r = 0; r < rings; ++r) {
    const double z = from + (to - from) * r / (rings - 1);
    for (int c = 0; c < 4; ++c) {
      const double angle = std::numbers::pi * (0.25 + 0.5 * c);
      V.row(4 * r + c) << static_cast<float>(half * std::numbers::sqrt2 * std::cos(angle)),
          static_cast<float>(half * std::numbers::sqrt2 * std::sin(angle)), static_cast<float>(z);
    }
  }
  V.row(4 * rings) << 0, 0, static_cast<float>(from);
  V.row(4 * rings + 1) << 0, 0, static_cast<float>(to);
  std::vector<std::array<int, 3>> faces;
  for (int c = 0; c < 4; ++c) {
    const int d = (c + 1) % 4;
    for (int r = 0; r + 1 < rings; ++r) {
      faces.push_back({4 * r + c, 4 * r + d, 4 * r + 4 + d});
      faces.push_back({4 * r + c, 4 * r + 4 + d, 4 * r + 4 + c});
    }
    faces.push_back({4 * rings, d, c});
    faces.push_back({4 * rings + 1, 4 * (rings - 1) + c, 4 * (rings - 1) + d});
  }
  F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    F.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  }
}

// The tet whose smallest barycentric coordinate is largest: holds the point, or is a near one.
void bind(const Model& model, Tissue& tissue) {
  tissue.tet.resize(static_cast<std::size_t>(tissue.V.rows()));
  tissue.barycentric.resize(tissue.V.rows(), 4);
  for (Eigen::Index v = 0; v < tissue.V.rows(); ++v) {
    double best = -1e30;
    for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
      const auto corner = [&](int c) -> Eigen::RowVector3d {
        return model.nodes.row(model.tets(t, c)).cast<double>();
      };
      const Eigen::RowVector3d x = tissue.V.row(v).cast<double>();
      const double whole = tet_det(corner(0), corner(1), corner(2), corner(3));
      const std::array<double, 4> b{tet_det(x, corner(1), corner(2), corner(3)) / whole,
                                    tet_det(corner(0), x, corner(2), corner(3)) / whole,
                                    tet_det(corner(0), corner(1), x, corner(3)) / whole,
                                    tet_det(corner(0), corner(1), corner(2), x) / whole};
      const double smallest = *std::min_element(b.begin(), b.end());
      if (smallest <= best) continue;
      best = smallest;
      tissue.tet[static_cast<std::size_t>(v)] = static_cast<std::int32_t>(t);
      for (int c = 0; c < 4; ++c)
        tissue.barycentric(v, c) = static_cast<float>(b[static_cast<std::size_t>(c)]);
    }
  }
}

void make_tissues(Model& model) {
  Tissue skin;
  skin.name = "skin";
  skin.group = Group::skin;
  make_tube(kSide / 2 + 1, -1, kLength + 1, 16, skin.V, skin.F);
  bind(model, skin);
  model.tissues.push_back(skin);
  for (int s = 0; s < 3; ++s) {
    Tissue bone;
    bone.name = "bone_" + model.rig.skeleton.segments[static_cast<std::size_t>(s)].name;
    bone.group = Group::bone;
    bone.segment = s;
    make_tube(6, 100 * s + 25, 100 * s + 75, 3, bone.V, bone.F);
    model.tissues.push_back(bone);
    model.bone_names.push_back(bone.name);
    model.bone_segment.push_back(s);
  }
  Tissue muscle;
  muscle.name = "muscle";
  muscle.group = Group::muscle;
  make_tube(12, 20, 280, 12, muscle.V, muscle.F);
  bind(model, muscle);
  model.tissues.push_back(muscle);
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {  // nearest to a bone's middle, along the axis
    const double z =
        static_cast<double>(model.nodes(model.tets(t, 0), 2) + model.nodes(model.tets(t, 3), 2)) / 2;
    const int s = static_cast<int>(std::clamp(z / 100, 0.0, 2.0));
    if (std::abs(z - 100 * s - 50) < 15)
      model.tet_label[static_cast<std::size_t>(t)] = static_cast<std::uint16_t>(s + 1);
  }
}

void make_volumes(Model& model) {
  ImageGrid grid;
  grid.size = {6, 6, 32};
  grid.spacing = {10, 10, 10};
  grid.origin = {-25, -25, -5};
  ModelVolume ct{"ct", Image(grid, ScalarType::i16), -1024, false, {}};
  ModelVolume labels{"labels", Image(grid, ScalarType::u8), 0, true, {{1, "body"}, {2, "core"}}};
  const auto hu = ct.image.scalars<std::int16_t>();
  const auto id = labels.image.scalars<std::uint8_t>();
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const auto x = grid.point(i, j, k);
        const bool body =
            std::abs(x[0]) < kSide / 2 && std::abs(x[1]) < kSide / 2 && x[2] > 0 && x[2] < kLength;
        const bool core = body && std::abs(x[0]) < 10 && std::abs(x[1]) < 10;
        hu[grid.offset(i, j, k)] =
            body ? static_cast<std::int16_t>(x[0] + 2 * x[1] + x[2]) : std::int16_t{-1024};
        id[grid.offset(i, j, k)] = static_cast<std::uint8_t>(core ? 2 : body ? 1 : 0);
      }
    }
  }
  model.volumes = {ct, labels};
}

// Every voxel of the bar as a ball, on the volumes' grid, in one chain.
void make_spheres(Model& model) {
  VolumetricSkeleton body;
  body.name = "body";
  body.grid = model.volumes[0].image.grid;
  body.thinness = -2;
  const auto& n = body.grid.size;
  const auto distance = [&](int i, int j, int k) {  // of a box: to its nearest face
    return std::max(0, std::min({i, n[0] - 1 - i, j, n[1] - 1 - j, k, n[2] - 1 - k}));
  };
  for (int k = 1; k < n[2] - 1; ++k) {
    for (int j = 1; j < n[1] - 1; ++j) {
      for (int i = 1; i < n[0] - 1; ++i) {
        int around = -distance(i, j, k);
        for (int d = 0; d < 27; ++d) around += distance(i + d % 3 - 1, j + d / 3 % 3 - 1, k + d / 9 - 1);
        body.parent.push_back(static_cast<std::int32_t>(body.size()) - 1);
        body.segment.push_back(
            static_cast<std::int32_t>(std::clamp(body.grid.point(i, j, k)[2] / 100, 0.0, 2.0)));
        body.voxel.push_back(
            {static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j), static_cast<std::uint16_t>(k)});
        const int own = distance(i, j, k);
        body.distance.push_back(static_cast<std::uint32_t>(own * own));
        body.deficit.push_back(static_cast<float>(own) - static_cast<float>(around) / 26);
      }
    }
  }
  model.spheres = {body};
}

JointCorrection made_up_correction(const Model& model, std::int32_t joint, const JointCorrection::Turns& turn,
                                   std::size_t modes) {
  std::vector<std::uint8_t> of_bone(model.node_count(), 0);
  for (std::size_t t = 0; t < model.tet_count(); ++t)
    for (int c = 0; c < 4 && model.tet_label[t] != TetMesh::soft; ++c)
      of_bone[static_cast<std::size_t>(model.tets(static_cast<Eigen::Index>(t), c))] = 1;
  JointCorrection out;
  out.joint = joint;
  out.turn = turn;
  std::uint32_t state = static_cast<std::uint32_t>(joint);
  const auto next = [&state] {
    return state = 1664525 * state + 1013904223;
  };  // Numerical Recipes' generator
  out.mix.resize(turn.rows(), static_cast<Eigen::Index>(modes));
  for (Eigen::Index i = 0; i < out.mix.size(); ++i)
    out.mix.data()[i] = static_cast<float>(next() >> 8) / (1 << 23) - 1;
  for (std::size_t m = 0; m < modes; ++m) out.scale.push_back(2e-4F * static_cast<float>(m + 1));
  for (std::uint32_t n = static_cast<std::uint32_t>(joint) % 2; n < model.node_count(); n += 2)
    if (of_bone[n] == 0) out.node.push_back(n);
  for (std::size_t i = 0; i < 3 * modes * out.node.size(); ++i)
    out.field.push_back(static_cast<std::int16_t>(next() >> 16));
  return out;
}

}  // namespace

Model toy_model() {
  Model model;
  model.name = "toy";
  make_mesh(model);
  make_rig(model);
  make_weights(model);
  make_centres(model);
  make_tissues(model);
  make_volumes(model);
  make_spheres(model);
  model.certificate.max_weight = 1;
  model.provenance = {{"ecorche", "toy"}, {"mesher", "by hand"}};
  return model;
}

Model fine_toy_model(int times) {
  Model model = toy_model();
  Image& image = model.volumes[0].image;
  const Image coarse = image;
  ImageGrid grid = coarse.grid;
  for (std::size_t a = 0; a < 3; ++a) {
    grid.size[a] *= times;
    grid.spacing[a] /= times;
  }
  image = Image(grid, coarse.type, coarse.components);
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        image.scalars<std::int16_t>()[grid.offset(i, j, k)] =
            coarse.scalars<std::int16_t>()[coarse.grid.offset(i / times, j / times, k / times)];
      }
    }
  }
  return model;
}

// Of the nodes of `like`, up to 9.8 mm.
PoseCorrection made_up_place(const JointCorrection& like) {
  PoseCorrection out;
  out.pose = "bent";
  out.joint = {1, 2};
  out.turn.resize(2, 3);
  out.turn << 0.7, 0, 0, 0.1, 0.3, -0.2;
  out.reach = 0.5;
  out.scale = 3e-4F;
  out.node = like.node;
  out.field.assign(like.field.begin(),
                   like.field.begin() + static_cast<std::ptrdiff_t>(3 * like.node.size()));
  return out;
}

Model corrected_toy_model() {
  Model model = toy_model();
  JointCorrection::Turns line(3, 3), around(5, 3);
  line << 0.8, 0, 0, -0.5, 0, 0, 0.3, 0, 0;
  around << 0.5, 0, 0, 0, -0.6, 0, 0, 0, 0.4, 0.3, 0.3, 0.2, -0.4, 0.1, -0.2;
  model.corrections = {made_up_correction(model, 1, line, 3), made_up_correction(model, 2, around, 2)};
  model.pose_corrections = {made_up_place(model.corrections[0])};
  SafeRange range;
  range.joint = 1;
  range.looked = 2.5;
  range.skinned = {0.75, 1.5};
  range.corrected = {1.25, SafeRange::none};
  model.safe_ranges = {range};
  model.safe_ranges[0].way = -1;
  model.safe_ranges.push_back(range);
  model.safe_ranges[1].bones = 2;
  model.safe_ranges[1].corrected.contact = 1.75;
  model.materials = {{-1, 4}, {5, 20}, std::vector<std::uint16_t>(model.tet_count(), 0)};
  for (std::size_t t = 0; t < model.tet_count(); t += 3)
    if (model.tet_label[t] == TetMesh::soft) model.materials.of_tet[t] = 1;
  return model;
}

}  // namespace ecorche::test
