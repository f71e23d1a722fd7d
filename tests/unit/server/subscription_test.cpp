// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/subscription.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "tests/support/toy_model.hpp"

namespace ecorche::server {
namespace {

TEST(Subscription, NoNamesAreAllTissuesAndOrderDoesNotMatter) {
  const Model model = test::toy_model();
  v1::Subscribe request;
  request.mutable_mesh();
  StreamSpec all;
  ASSERT_TRUE(read_spec(request, model, all).ok());
  EXPECT_EQ(std::get<MeshSpec>(all).tissues.size(), model.tissues.size());
  for (auto tissue = model.tissues.rbegin(); tissue != model.tissues.rend(); ++tissue)
    request.mutable_mesh()->add_tissues(tissue->name);
  request.mutable_mesh()->add_tissues(model.tissues[0].name);
  StreamSpec named;
  ASSERT_TRUE(read_spec(request, model, named).ok());
  EXPECT_EQ(all, named);
  request.mutable_mesh()->set_quality(true);
  ASSERT_TRUE(read_spec(request, model, named = StreamSpec()).ok());
  EXPECT_NE(all, named);
}

TEST(Subscription, LabelsAreAlwaysNearest) {
  const Model model = test::toy_model();
  for (const ModelVolume& volume : model.volumes) {
    v1::Subscribe request;
    request.mutable_volume()->set_volume(volume.name);
    StreamSpec spec;
    ASSERT_TRUE(read_spec(request, model, spec).ok());
    const auto expected = volume.labels ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
    EXPECT_EQ(std::get<VolumeSpec>(spec).sampling, expected) << volume.name;
  }
}

TEST(Subscription, WhatCannotBeDoneSaysSo) {
  const Model model = test::toy_model();
  struct Case {
    const char* what;
    std::function<void(v1::Subscribe&)> ask;
    StatusCode code;
  };
  const std::string ct = model.volumes[0].name;
  const Case cases[] = {
      {"nothing", [](v1::Subscribe&) {}, StatusCode::invalid_argument},
      {"tissue", [](v1::Subscribe& s) { s.mutable_mesh()->add_tissues("tail"); }, StatusCode::not_found},
      {"volume", [](v1::Subscribe& s) { s.mutable_volume()->set_volume("mri"); }, StatusCode::not_found},
      {"rate",
       [](v1::Subscribe& s) {
         s.mutable_mesh();
         s.set_max_rate(-1);
       },
       StatusCode::invalid_argument},
      {"encoding", [](v1::Subscribe& s) { s.mutable_mesh()->set_encoding(static_cast<v1::Encoding>(4)); },
       StatusCode::unimplemented},
      {"encoding", [](v1::Subscribe& s) { s.mutable_mesh()->set_encoding(static_cast<v1::Encoding>(-1)); },
       StatusCode::unimplemented},
      {"level", [](v1::Subscribe& s) { s.mutable_mesh()->set_level(4); }, StatusCode::invalid_argument},
      {"nodes and more",
       [](v1::Subscribe& s) {
         s.mutable_mesh()->set_control_nodes(true);
         s.mutable_mesh()->set_encoding(v1::ENCODING_U16);
       },
       StatusCode::invalid_argument},
      {"mesh region",
       [](v1::Subscribe& s) {
         s.mutable_mesh()->mutable_region()->mutable_min()->set_x(1);
         s.mutable_mesh()->mutable_region()->mutable_max()->set_x(0);
       },
       StatusCode::invalid_argument},
      {"region",
       [&](v1::Subscribe& s) {
         s.mutable_volume()->set_volume(ct);
         s.mutable_volume()->mutable_region()->mutable_min()->set_x(1);
       },
       StatusCode::invalid_argument},
      {"slices of a region",
       [&](v1::Subscribe& s) {
         s.mutable_volume()->set_volume(ct);
         s.mutable_volume()->mutable_region();
         v1::Slice& slice = *s.mutable_volume()->add_slices();
         slice.mutable_u()->set_x(1);
         slice.mutable_v()->set_y(1);
         slice.set_size_u(5);
         slice.set_size_v(5);
       },
       StatusCode::invalid_argument},
      {"slices",
       [&](v1::Subscribe& s) {
         s.mutable_volume()->set_volume(ct);
         s.mutable_volume()->add_slices()->set_size_u(5);
       },
       StatusCode::invalid_argument},
      {"too many slices",
       [&](v1::Subscribe& s) {
         s.mutable_volume()->set_volume(ct);
         for (int i = 0; i < 17; ++i) s.mutable_volume()->add_slices();
       },
       StatusCode::invalid_argument},
  };
  for (const Case& c : cases) {
    v1::Subscribe request;
    c.ask(request);
    StreamSpec spec;
    const Status status = read_spec(request, model, spec);
    EXPECT_EQ(status.code, c.code) << c.what;
    EXPECT_NE(status.message.find("subscribe: "), std::string::npos) << status.message;
  }
}

// Where a pixel is no number, every one of them would be asked of every sphere.
TEST(Subscription, PlanesLieWhereNumbersReach) {
  const Model model = test::toy_model();
  const auto read = [&](double origin, double u, double v) {
    v1::Subscribe request;
    request.mutable_volume()->set_volume(model.volumes[0].name);
    v1::Slice& slice = *request.mutable_volume()->add_slices();
    slice.mutable_origin()->set_z(origin);
    slice.mutable_u()->set_x(u);
    slice.mutable_v()->set_y(v);
    slice.set_size_u(5);
    slice.set_size_v(5);
    StreamSpec spec;
    return read_spec(request, model, spec);
  };
  for (const double at : {0.0, -1e9, 1e9}) EXPECT_TRUE(read(at, 1, -2).ok()) << at;
  for (const double step : {2e-9, -5e8}) EXPECT_TRUE(read(0, step, 1).ok() && read(0, 1, step).ok()) << step;
  for (const double at : {2e9, -1e300, double{INFINITY}, double{NAN}})
    EXPECT_FALSE(read(at, 1, 1).ok()) << at;
  for (const double step : {0.0, 1e-10, 1e-200, 2e9, 1e200, double{INFINITY}, double{NAN}}) {
    EXPECT_FALSE(read(0, step, 1).ok()) << step;
    EXPECT_NE(read(0, 1, step).message.find("a slice is no plane"), std::string::npos) << step;
  }
}

}  // namespace
}  // namespace ecorche::server
