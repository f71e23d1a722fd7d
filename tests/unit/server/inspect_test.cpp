// SPDX-License-Identifier: Apache-2.0
// Radiographs and numbers of vertices over the wire, held against the same made offline.
#include <algorithm>
#include <limits>
#include <memory>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/radiograph_choice.hpp>
#include <ecorche/runtime/radiograph_scan.hpp>
#include <ecorche/runtime/resample.hpp>
#include "proto/arrays.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

template <class T>
std::vector<T> numbers(const v1::Array& array, const wire::Payload& payload) {
  std::span<const T> found;
  EXPECT_TRUE(wire::find(array, payload, 1, found));
  return {found.begin(), found.end()};
}

v1::Envelope shot(const char* target) {
  v1::Envelope envelope;
  v1::RenderRadiograph& render = *envelope.mutable_render_radiograph();
  render.set_view(v1::RenderRadiograph::VIEW_PA);
  render.set_turn(0.3);
  render.set_target(target);
  render.set_columns(48);
  render.set_rows(40);
  return envelope;
}

// The toy body bent and carried away, as a client poses it.
Pose far_bent(const TestClient& client) {
  Pose pose = client.bent(0.6);
  pose.root_translation = {300, -40, 7};
  pose.rotation[0] = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized());
  return pose;
}

struct OfflineInspected {
  std::shared_ptr<const Model> model;
  runtime::BodyPoser poser;
  runtime::PosedBody body;
  RigidTransform root;

  OfflineInspected(const Model& of, const Pose& pose)
      : model(std::make_shared<const Model>(of)), poser(model), body(poser.make_frame()) {
    EXPECT_TRUE(poser
                    .run(pose, runtime::Skinning::cor, poser.all_tissues(), body, runtime::NodesOf::body,
                         runtime::Root::still)
                    .ok());
    root = kinematics::forward(model->rig, body.pose)[0];
  }
  runtime::ChosenSetup setup(const char* target) const {
    runtime::SetupChoice choice;
    choice.beam = {runtime::View::pa, 0.3};
    choice.target = target;
    choice.plate.pixels = {48, 40};
    return runtime::setup_of(choice, *model, body, root);
  }
  // All of the posed volume, whatever lies in the beam.
  std::vector<float> whole(const runtime::XRaySetup& setup) const {
    const ModelVolume& ct = model->volumes[0];
    const Image posed = runtime::pose_volume(model, body.nodes, ct, runtime::Sampling::trilinear,
                                             runtime::grow_to(ct.image.grid, body.nodes));
    return runtime::line_integrals(runtime::attenuation_map(posed, runtime::Attenuation()), setup);
  }
  std::vector<float> in_beam(const runtime::XRaySetup& setup) const {
    runtime::ScanScratch scratch;
    return runtime::line_integrals(runtime::VolumePoser(model), body.nodes, model->volumes[0],
                                   runtime::Attenuation(), setup, scratch);
  }
};

TEST(InspectTest, ARadiographIsThatMadeOffline) {
  const TestServer server;
  TestClient client(server);
  client.send(4, far_bent(client));
  client.next_ack();
  const OfflineInspected offline(server.model(), far_bent(client));
  const runtime::ChosenSetup setup = offline.setup("tip");
  const wire::Frame answer = client.client().call(shot("tip"));
  const v1::Radiograph& picture = answer.envelope.radiograph();
  EXPECT_EQ(picture.pose_sequence(), 4U);
  EXPECT_EQ(picture.volume(), 0U);
  EXPECT_EQ(picture.columns(), 48U);
  EXPECT_NEAR(picture.source_to_detector(), 1000, 1e-9);
  EXPECT_EQ(picture.setup().source().x(), setup.here.source.x());
  EXPECT_EQ(picture.setup().down().z(), setup.here.detector.down.z());
  const std::vector<float> integrals = numbers<float>(picture.picture(), answer.payload);
  EXPECT_EQ(integrals, offline.in_beam(setup.still));
  const std::vector<float> whole = offline.whole(setup.still);
  ASSERT_EQ(integrals.size(), whole.size());
  for (std::size_t i = 0; i < whole.size(); ++i) EXPECT_NEAR(integrals[i], whole[i], 1e-4) << i;
  EXPECT_GT(picture.largest(), 0.3);
  EXPECT_EQ(picture.largest(), *std::max_element(integrals.begin(), integrals.end()));

  v1::Envelope grey = shot("tip");
  grey.mutable_render_radiograph()->set_content(v1::RenderRadiograph::CONTENT_GREY_16);
  grey.mutable_render_radiograph()->set_linear(true);
  grey.mutable_render_radiograph()->set_high(0.5);
  const wire::Frame sixteen = client.client().call(grey);
  const std::vector<std::uint16_t> expected =
      runtime::expose(integrals, {runtime::Exposure::Scale::linear, 0, 0.5});
  EXPECT_EQ(numbers<std::uint16_t>(sixteen.envelope.radiograph().picture(), sixteen.payload), expected);
  grey.mutable_render_radiograph()->set_content(v1::RenderRadiograph::CONTENT_GREY_8);
  const wire::Frame eight = client.client().call(grey);
  const auto coarse = numbers<std::uint8_t>(eight.envelope.radiograph().picture(), eight.payload);
  for (std::size_t i = 0; i < coarse.size(); ++i) EXPECT_NEAR(257.0 * coarse[i], expected[i], 128.5) << i;
}

TEST(InspectTest, SurfacesAndPlacesAsOffline) {
  const TestServer server;
  TestClient client(server);
  client.send(1, far_bent(client));
  client.next_ack();
  const OfflineInspected offline(server.model(), far_bent(client));
  const runtime::ChosenSetup setup = offline.setup("middle");
  v1::Envelope first = shot("middle");
  first.mutable_render_radiograph()->set_surfaces(true);
  const wire::Frame answer = client.client().call(first);
  EXPECT_FALSE(answer.envelope.radiograph().has_volume());
  EXPECT_EQ(numbers<float>(answer.envelope.radiograph().picture(), answer.payload),
            runtime::line_integrals(*offline.model, offline.body, runtime::Attenuation(), setup.still));
  // The same where somebody puts source and detector there.
  v1::Envelope placed;
  v1::RenderRadiograph& render = *placed.mutable_render_radiograph();
  *render.mutable_placed() = answer.envelope.radiograph().setup();
  render.set_surfaces(true);
  render.set_columns(48);
  render.set_rows(40);
  const wire::Frame again = client.client().call(placed);
  const auto one = numbers<float>(answer.envelope.radiograph().picture(), answer.payload);
  const auto other = numbers<float>(again.envelope.radiograph().picture(), again.payload);
  std::size_t off = 0;
  for (std::size_t i = 0; i < one.size(); ++i) off += std::abs(one[i] - other[i]) > 1e-3F ? 1U : 0U;
  EXPECT_LT(off, 8U);  // at edges, by rounding
}

std::string refusal(client::Client& client, const v1::Envelope& request) {
  try {
    client.call(request);
  } catch (const Error& error) {
    return error.what();
  }
  return "it was not refused";
}

TEST(InspectTest, RadiographsAreRefusedByName) {
  const TestServer server;
  TestClient client(server);
  const auto refused = [&](auto&& change) {
    v1::Envelope request = shot("tip");
    change(*request.mutable_render_radiograph());
    return refusal(client.client(), request);
  };
  using R = v1::RenderRadiograph;
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(refused([](R& r) { r.set_target("tiip"); }), "the model has no 'tiip'");
  has(refused([](R& r) { r.set_volume("mr"); }), "no volume 'mr'");
  has(refused([](R& r) { r.set_volume("labels"); }), "'labels' holds no Hounsfield units");
  has(refused([](R& r) {
        r.set_volume("ct");
        r.set_surfaces(true);
      }),
      "`surfaces` beside a volume");
  has(refused([](R& r) { r.set_columns(3000), r.set_rows(3000); }), "3000 x 3000 pixels");
  has(refused([](R& r) { r.set_columns(4294967295U), r.set_rows(4294967295U); }), "pixels (ask for at most");
  has(refused([](R& r) { r.set_energy(10); }), "10 keV");
  has(refused([](R& r) { r.set_turn(std::numeric_limits<double>::quiet_NaN()); }), "turn: it is no number");
  has(refused([](R& r) { r.set_width(-1); }), "a side of no length");
  has(refused([](R& r) { r.set_low(-1); }), "`low` and `high`");
  has(refused([](R& r) { r.set_source_to_detector(12); }), "would not stand before it");
  has(refused([](R& r) { r.mutable_placed(); }), "a view beside `placed`");
  has(refused([](R& r) { r.mutable_target_point(); }), "`target` beside `target_point`");
  has(refused([](R& r) {
        r.Clear();
        r.mutable_placed();
      }),
      "it lies in the detector");
  Model bare = test::toy_model();
  bare.volumes.clear();
  bare.spheres.clear();
  const TestServer without({}, bare);
  TestClient other(without);
  has(refusal(other.client(), shot("tip")),
      "the model has no volume of Hounsfield units (set `surfaces`, or preprocess the case with its CT)");
}

TEST(InspectTest, OneRadiographOfAConnectionAtATime) {
  const TestServer server;
  RawClient raw(server);
  raw.send_hello();
  ASSERT_TRUE(raw.receive());
  v1::Envelope open;
  open.mutable_open_model()->set_model("toy");
  raw.send(open);
  ASSERT_TRUE(raw.receive());
  v1::Envelope large = shot("tip");
  large.mutable_render_radiograph()->set_columns(2048);
  large.mutable_render_radiograph()->set_rows(2048);
  large.set_request_id(7);
  raw.send(large);
  large.set_request_id(8);
  raw.send(large);
  const auto first = raw.receive(), second = raw.receive();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->envelope.request_id(), 8U);
  EXPECT_EQ(first->envelope.status().code(), static_cast<std::uint32_t>(StatusCode::resource_exhausted));
  EXPECT_EQ(second->envelope.request_id(), 7U);
  EXPECT_EQ(second->envelope.radiograph().picture().count(), 2048U * 2048U);
}

TEST(InspectTest, MemoryThatAPosedVolumeTakesHasALimit) {
  Limits limits;
  limits.volume_voxels = 50;
  const TestServer server(limits);
  TestClient client(server);
  EXPECT_NE(refusal(client.client(), shot("tip")).find("voxels lie in the beam (at most 50;"),
            std::string::npos);
}

TEST(InspectTest, FieldsAreThoseOfTheTets) {
  const TestServer server;
  TestClient client(server);
  client.send(9, far_bent(client));
  client.next_ack();
  const Model& model = server.model();
  const OfflineInspected offline(model, far_bent(client));
  const std::vector<float> det = runtime::tet_det_f(model, offline.body.nodes);
  v1::Envelope request;
  request.mutable_sample_field()->set_kind(v1::SampleField::KIND_DET_F);
  const wire::Frame answer = client.client().call(request);
  const v1::Field& field = answer.envelope.field();
  EXPECT_EQ(field.pose_sequence(), 9U);
  ASSERT_EQ(field.parts_size(), static_cast<int>(model.tissues.size()));
  float least = 1;
  for (const v1::FieldPart& part : field.parts()) {
    const Tissue& tissue = model.tissues[part.tissue()];
    const std::vector<float> values = numbers<float>(part.values(), answer.payload);
    ASSERT_EQ(values.size(), static_cast<std::size_t>(tissue.V.rows()));
    for (std::size_t v = 0; v < values.size(); ++v) {
      EXPECT_EQ(values[v], tissue.tet.empty() ? 1 : det[static_cast<std::size_t>(tissue.tet[v])]);
      least = std::min(least, values[v]);
    }
  }
  EXPECT_EQ(field.least(), static_cast<double>(least));
  EXPECT_LT(least, 0.95F);

  request.mutable_sample_field()->set_kind(v1::SampleField::KIND_WEIGHT);
  request.mutable_sample_field()->set_segment(1);
  const Tissue& skin = model.tissues[0];
  request.mutable_sample_field()->add_tissues(skin.name);
  const wire::Frame weighed = client.client().call(request);
  const std::vector<float> weights =
      numbers<float>(weighed.envelope.field().parts(0).values(), weighed.payload);
  // By the blend of the toy: all of the middle segment half way, none of it at the ends.
  std::size_t whole = 0, none = 0;
  for (std::size_t v = 0; v < weights.size(); ++v) {
    const float z = skin.V(static_cast<Eigen::Index>(v), 2);
    if (std::abs(z - 150) < 20) whole += weights[v] > 0.999F ? 1U : 100000U;
    if (z < 60 || z > 240) none += weights[v] < 1e-3F ? 1U : 100000U;
  }
  EXPECT_GT(whole, 0U);
  EXPECT_LT(whole, 100000U);
  EXPECT_GT(none, 0U);
  EXPECT_LT(none, 100000U);
}

TEST(InspectTest, FieldsAreRefusedByName) {
  const TestServer server;
  TestClient client(server);
  v1::Envelope request;
  v1::SampleField& sample = *request.mutable_sample_field();
  EXPECT_NE(refusal(client.client(), request).find("field: no kind"), std::string::npos);
  sample.set_kind(v1::SampleField::KIND_WEIGHT);
  sample.set_segment(3);
  EXPECT_NE(refusal(client.client(), request).find("field: no segment 3"), std::string::npos);
  sample.set_segment(2);
  sample.add_tissues("nose");
  EXPECT_NE(refusal(client.client(), request).find("field: no tissue 'nose'"), std::string::npos);
}

}  // namespace
}  // namespace ecorche::server
