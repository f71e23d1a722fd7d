// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "app/report/html.hpp"
#include "app/report/page.hpp"
#include "app/report/places.hpp"
#include "app/report/quality.hpp"
#include "app/report/slice.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::app::report {
namespace {

constexpr Colour kGround{1, 2, 3};

TEST(Escaped, nothing_in_a_text_becomes_markup) {
  EXPECT_EQ(escaped("<script>'\"&"), "&lt;script&gt;&#39;&quot;&amp;");
  EXPECT_EQ(escaped("plain text_1 é"), "plain text_1 é");
  EXPECT_EQ(escaped(std::string("a\0b\x1b", 4)), "a?b?");
  EXPECT_EQ(escaped("\xff"), "\xef\xbf\xbd");
}

TEST(Histogram, counts_by_bin_and_keeps_what_lies_beyond_at_the_ends) {
  Histogram histogram("angle", "deg", 0, 10, 5);
  for (const double value : {-3.0, 0.0, 1.99, 2.0, 9.99, 10.0, 400.0}) histogram.add(value);
  EXPECT_EQ(histogram.count, (std::vector<std::size_t>{3, 1, 0, 0, 3}));
  const std::string drawn = svg(histogram);
  EXPECT_NE(drawn.find("<title>0 to 2 deg: 3 (42.9 %)</title>"), std::string::npos) << drawn;
  EXPECT_EQ(drawn.find("4 to 6"), std::string::npos) << "an empty bin has no bar";
  EXPECT_NE(svg(Histogram("none", "", 0, 1, 3)).find("</svg>"), std::string::npos);
}

TEST(RadiusRatio, of_tets_that_are_known) {
  EXPECT_NEAR(radius_ratio({Eigen::Vector3d(1, 1, 1), {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}), 1, 1e-12);
  // The corner of a cube: r = 1 / (3 + sqrt 3), R = sqrt(3) / 2.
  EXPECT_NEAR(radius_ratio({Eigen::Vector3d(0, 0, 0), {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}),
              6 / (std::sqrt(3.0) * (3 + std::sqrt(3.0))), 1e-12);
  EXPECT_EQ(radius_ratio({Eigen::Vector3d(0, 0, 0), {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}), 0);
  // A sliver of four points near a square.
  EXPECT_LT(radius_ratio({Eigen::Vector3d(0, 0, 1e-3), {1, 0, 0}, {1, 1, 1e-3}, {0, 1, 0}}), 0.01);
}

TEST(Scene, nearer_surfaces_cover_farther_ones_from_every_side) {
  PointsF square(4, 3);
  Triangles F(2, 3);
  F << 0, 1, 2, 0, 2, 3;
  for (const View& from : {View::coronal(), View::sagittal(), View::axial()}) {
    const View view = from.of({-10, -10, -10}, {10, 10, 10}, 100);
    const auto at = [&](double half, double depth) {
      const Eigen::Vector3d a = view.across * half, b = view.up * half, d = view.toward * depth;
      for (int c = 0; c < 4; ++c) {
        const Eigen::Vector3d p = (c == 0 || c == 3 ? -a : a) + (c < 2 ? -b : b) + d;
        square.row(c) = p.transpose().cast<float>();
      }
      return square;
    };
    for (const bool far_first : {true, false}) {
      Scene scene(view, kGround);
      const Colour far{200, 0, 0}, near{0, 200, 0};
      scene.surface(at(far_first ? 8 : 4, far_first ? -5 : 5), F, far_first ? far : near);
      scene.surface(at(far_first ? 4 : 8, far_first ? 5 : -5), F, far_first ? near : far);
      const Picture picture = scene.picture();
      const int mid = picture.width / 2;
      EXPECT_EQ(picture.at(mid, mid), near);
      EXPECT_EQ(picture.at(mid + 30, mid), far);
      EXPECT_EQ(picture.at(2, 2), kGround);
      // As many pixels as the squares are large.
      const auto count = [&](const Colour& colour) {
        return std::count(picture.pixels.begin(), picture.pixels.end(), colour);
      };
      EXPECT_NEAR(static_cast<double>(count(near)), std::pow(8 / view.pixel_mm, 2), 4 * 40);
      EXPECT_NEAR(static_cast<double>(count(far) + count(near)), std::pow(16 / view.pixel_mm, 2), 4 * 80);
    }
  }
}

TEST(View, left_is_right_and_up_is_up) {
  const View view = View::coronal().of({-100, -50, 0}, {100, 50, 400}, 200);
  EXPECT_EQ(view.height, 200);
  EXPECT_EQ(view.width, 100);
  EXPECT_GT(view.x({50, 0, 0}), view.x({-50, 0, 0})) << "the patient's left is on the right";
  EXPECT_LT(view.y({0, 0, 300}), view.y({0, 0, 100}));
  const Eigen::Vector3d p(12, view.centre[1], 77);
  EXPECT_LT((view.point(view.x(p), view.y(p)) - p).norm(), 1e-9);
  EXPECT_GT(View::sagittal().of({-1, -1, -1}, {1, 1, 1}, 9).x({0, 1, 0}), 4) << "the back is on the right";
  EXPECT_GT(View::axial().of({-1, -1, -1}, {1, 1, 1}, 9).y({0, 1, 0}), 4) << "the front is on top";
}

TEST(DataUri, what_is_no_picture_is_said) {
  EXPECT_EQ(data_uri(Picture(1, 1, {255, 0, 0})).substr(0, 22), "data:image/png;base64,");
  try {
    data_uri(Picture(0, 0, {}));
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::internal);
    EXPECT_EQ(std::string(error.what()).find("report: libpng cannot write the picture: "), 0U)
        << error.what();
  }
}

// The mean over the bone's tets in the rows around, and nothing else.
TEST(Slice, goes_where_the_bones_are) {
  Model model = test::toy_model();
  const Box box = box_of(model);
  const View view = View::coronal().of(box.low, box.high, 40);
  std::fill(model.tet_label.begin(), model.tet_label.end(), TetMesh::soft);
  EXPECT_EQ(depth_of_bones(model, view), std::vector<double>(static_cast<std::size_t>(view.height), 0));
  model.tet_label[0] = 1;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (int c = 0; c < 4; ++c) centre += model.nodes.row(model.tets(0, c)).transpose().cast<double>() / 4;
  for (const double depth : depth_of_bones(model, view))
    EXPECT_NEAR(depth, (centre - view.centre).dot(view.toward), 1e-9);
}

// Every pixel against a search of all tets.
TEST(Slice, shows_the_mixed_weights_of_the_tet_that_holds_each_pixel) {
  const Model model = test::toy_model();
  const Box box = box_of(model);
  for (const View& from : {View::coronal(), View::sagittal(), View::axial()}) {
    View view = from.of(box.low, box.high, 60);
    view.centre += 0.013 * view.toward;  // off the nodes
    // The axial one through a sheet that bends.
    std::vector<double> depth(static_cast<std::size_t>(view.height), 0);
    for (std::size_t row = 0; from.up.y() != 0 && row < depth.size(); ++row)
      depth[row] = 0.3 * std::sin(0.2 * static_cast<double>(row)) * view.pixel_mm;
    const Picture picture = slice(model, view, kGround, depth);
    int inside = 0, right = 0;
    for (int row = 0; row < view.height; ++row) {
      for (int column = 0; column < view.width; ++column) {
        const Eigen::Vector3d p =
            view.point(column, row) + depth[static_cast<std::size_t>(row)] * view.toward;
        Colour expected = kGround;
        for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
          Eigen::Matrix4d corners = Eigen::Matrix4d::Ones();
          for (int c = 0; c < 4; ++c)
            corners.block<3, 1>(0, c) = model.nodes.row(model.tets(t, c)).transpose().cast<double>();
          const Eigen::Vector4d b = corners.inverse() * Eigen::Vector4d(p[0], p[1], p[2], 1);
          if (b.minCoeff() < 0) continue;
          std::array<double, 3> sum{};
          for (int c = 0; c < 4; ++c) {
            const auto node = static_cast<std::size_t>(model.tets(t, c));
            for (auto i = model.weights.offsets[node]; i < model.weights.offsets[node + 1]; ++i) {
              const Colour colour = colour_of(model.weights.segment[i]);
              for (std::size_t k = 0; k < 3; ++k) sum[k] += b[c] * model.weights.weight[i] * colour[k];
            }
          }
          for (std::size_t k = 0; k < 3; ++k) expected[k] = static_cast<std::uint8_t>(std::lround(sum[k]));
          if (model.tet_label[static_cast<std::size_t>(t)] != TetMesh::soft)
            expected = mixed(expected, {255, 255, 255}, 0.65);
        }
        inside += expected != kGround ? 1 : 0;
        if (expected == kGround) {
          // A rim of the body may darken its neighbour, never lighten it.
          EXPECT_LE(picture.at(column, row)[0], 20);
          continue;
        }
        right += picture.at(column, row) == expected ? 1 : 0;
      }
    }
    EXPECT_GT(inside, 20);
    EXPECT_GT(right, inside / 2) << "all but the rims";
  }
}

TEST(Grouped, warnings_that_differ_in_names_alone_are_one) {
  const Model model = test::toy_model();
  const std::string tissue = model.tissues.at(0).name, other = model.tissues.back().name;
  const std::string joint = model.rig.skeleton.segments.at(1).joint.name;
  ASSERT_NE(tissue, other);
  const auto groups = grouped(model, {"tissue " + tissue + ": sticks out", "nothing of the model, 3 mm",
                                      "tissue " + other + ": sticks out", "joint " + joint + " is unsure",
                                      "tissue " + tissue + ": sticks out", tissue + tissue + ": unknown"});
  ASSERT_EQ(groups.size(), 4U);
  EXPECT_EQ(groups[0].count, 3U);
  EXPECT_EQ(groups[0].text, "tissue " + tissue + ": sticks out");
  EXPECT_EQ(groups[0].tissues, (std::vector<std::string>{tissue, other}));
  EXPECT_EQ(groups[1].count, 1U);
  EXPECT_TRUE(groups[1].tissues.empty() && groups[1].joints.empty());
  EXPECT_EQ(groups[2].joints, (std::vector<std::string>{joint}));
  EXPECT_TRUE(groups[3].tissues.empty()) << "a part of a word is no name";
}

TEST(Page, holds_every_part_and_nothing_from_elsewhere) {
  Model model = test::toy_model();
  model.name = "</title><script>alert(1)</script>";
  model.certificate.bone_rigidity_mm = 2;  // beyond its bound
  const std::vector<preprocess::StageTime> stages{{"mesh", 1.5, 100, false}, {"weights", 0.5, 200, true}};
  const std::string tissue = model.tissues.at(0).name;
  const std::vector<std::string> warnings{"tissue " + tissue + ": <b>out</b>"};
  const std::string html = page({model, stages, warnings});
  for (const char* part :
       {"breaks its bounds", "<h2>Certificate", "<h2>Bones and weights", "<h2>Rig", "<h2>Quality",
        "<h2>Warnings", "<h2>Times", "<h2>Provenance", "kept from an earlier run", "not for planning surgery",
        "&lt;b&gt;out", "bone_rigidity_mm<td class='n bad'>2"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  for (const char* part : {"<script", "http:", "https:", "href=", "<b>out"})
    EXPECT_EQ(html.find(part), std::string::npos) << part;
  EXPECT_EQ(page({model, stages, warnings}), html);
}

}  // namespace
}  // namespace ecorche::app::report
