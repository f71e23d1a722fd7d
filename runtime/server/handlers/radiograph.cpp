// SPDX-License-Identifier: Apache-2.0
// Pictures as an X-ray source and a detector would make them of the present pose.
#include <algorithm>
#include <string>
#include <utility>

#include <ecorche/wire/convert.hpp>
#include "proto/arrays.hpp"
#include "runtime/server/handlers/handlers.hpp"
#include "runtime/server/resources/guarded.hpp"
#include "runtime/server/session/radiograph_job.hpp"

namespace ecorche::server {
namespace {

constexpr std::uint64_t kMaxPixels = 1 << 22;
constexpr std::int32_t kPixels = 512;  // along a side that is not said

// What is asked beside the picture's integrals, and who asked.
struct RadiographRequest {
  std::uint64_t id = 0;
  v1::RenderRadiograph::Content content{};
  runtime::Exposure exposure;
  RadiographJob job;
};

Status invalid(const std::string& what) {
  return {StatusCode::invalid_argument, "radiograph: " + what};
}

Status read_volume(const v1::RenderRadiograph& render, const Model& model, RadiographJob& out) {
  if (render.surfaces())
    return render.volume().empty() ? Status{} : invalid("`surfaces` beside a volume (leave out one of them)");
  const ModelVolume* found = nullptr;
  if (render.volume().empty()) {
    found = runtime::scan_of(model);
    if (!found)
      return {StatusCode::failed_precondition,
              "radiograph: the model has no volume of Hounsfield units (set `surfaces`, or preprocess the "
              "case with its CT)"};
  } else {
    const auto row = std::find_if(model.volumes.begin(), model.volumes.end(),
                                  [&](const ModelVolume& v) { return v.name == render.volume(); });
    if (row == model.volumes.end())
      return {StatusCode::not_found,
              "radiograph: no volume '" + render.volume() + "' (ModelOpened.volumes has the names)"};
    if (row->labels || row->image.components != 1)
      return invalid("'" + render.volume() + "' holds no Hounsfield units (name a CT, or set `surfaces`)");
    found = &*row;
  }
  out.volume = static_cast<std::uint32_t>(found - model.volumes.data());
  return {};
}

runtime::View view_of(v1::RenderRadiograph::View view) {
  switch (view) {
    case v1::RenderRadiograph::VIEW_PA:
      return runtime::View::pa;
    case v1::RenderRadiograph::VIEW_LATERAL_LEFT:
      return runtime::View::lateral_left;
    case v1::RenderRadiograph::VIEW_LATERAL_RIGHT:
      return runtime::View::lateral_right;
    default:
      return runtime::View::ap;
  }
}

runtime::PlacedXRay placed_of(const v1::XRaySetup& setup) {
  runtime::PlacedXRay out{wire::from_proto(setup.source()), wire::from_proto(setup.detector()), {}};
  if (setup.has_right() || setup.has_down())
    out.axes = {wire::from_proto(setup.right()), wire::from_proto(setup.down())};
  return out;
}

Status read_setup(const v1::RenderRadiograph& render, runtime::SetupChoice& out) {
  const auto or_usual = [](double given, double usual) { return given == 0 ? usual : given; };
  out.plate.size_mm = {or_usual(render.width(), out.plate.size_mm[0]),
                       or_usual(render.height(), out.plate.size_mm[1])};
  const std::uint64_t columns = render.columns() == 0 ? kPixels : render.columns();
  const std::uint64_t rows = render.rows() == 0 ? kPixels : render.rows();
  if (columns > kMaxPixels || rows > kMaxPixels || columns * rows > kMaxPixels) {
    return invalid(std::to_string(columns) + " x " + std::to_string(rows) + " pixels (ask for at most " +
                   std::to_string(kMaxPixels) + ")");
  }
  out.plate.pixels = {static_cast<std::int32_t>(columns), static_cast<std::int32_t>(rows)};
  if (!v1::RenderRadiograph::View_IsValid(render.view()))
    return invalid("there is no view " + std::to_string(render.view()));
  if (render.has_placed()) {
    if (render.view() != 0 || render.turn() != 0 || !render.target().empty() || render.has_target_point() ||
        render.source_to_detector() != 0 || render.has_target_to_detector())
      return invalid("a view beside `placed` (leave out one of them)");
    out.placed = placed_of(render.placed());
  } else {
    out.beam = {view_of(render.view()), render.turn()};
    out.target = render.target();
    if (render.has_target_point()) out.point = wire::from_proto(render.target_point());
    if (out.point && !out.target.empty())
      return invalid("`target` beside `target_point` (leave out one of them)");
    out.sid_mm = or_usual(render.source_to_detector(), out.sid_mm);
    if (render.has_target_to_detector()) out.oid_mm = render.target_to_detector();
  }
  runtime::check(out);
  return {};
}

Status read_request(const v1::RenderRadiograph& render, const Model& model, RadiographRequest& out) {
  if (!v1::RenderRadiograph::Content_IsValid(render.content()))
    return invalid("there is no content " + std::to_string(render.content()));
  out.content = render.content();
  if (!(render.low() >= 0 && render.low() <= 1e6) || !(render.high() >= 0 && render.high() <= 1e6))
    return invalid("`low` and `high` are line integrals (0 to 1e6)");
  out.exposure = {render.linear() ? runtime::Exposure::Scale::linear : runtime::Exposure::Scale::log,
                  render.low(), render.high()};
  if (render.energy() != 0) out.job.kev = runtime::Attenuation(render.energy()).kev();
  if (Status status = read_volume(render, model, out.job); !status.ok()) return status;
  return read_setup(render, out.job.choice);
}

v1::Array append_picture(const RadiographRequest& asked, const runtime::Exposure& exposure,
                         wire::Payload& payload) {
  const std::vector<float>& integrals = asked.job.integrals;
  if (asked.content != v1::RenderRadiograph::CONTENT_GREY_16 &&
      asked.content != v1::RenderRadiograph::CONTENT_GREY_8)
    return wire::append(payload, std::span<const float>(integrals), 1);
  const std::vector<std::uint16_t> grey = runtime::expose(integrals, exposure);
  if (asked.content == v1::RenderRadiograph::CONTENT_GREY_16)
    return wire::append(payload, std::span<const std::uint16_t>(grey), 1);
  std::vector<std::uint8_t> coarse(grey.size());
  std::transform(grey.begin(), grey.end(), coarse.begin(),
                 [](std::uint16_t v) { return static_cast<std::uint8_t>((v + 128) / 257); });
  return wire::append(payload, std::span<const std::uint8_t>(coarse), 1);
}

// The answer, written where the picture was made.
struct Written {
  v1::Envelope envelope;
  std::shared_ptr<wire::Payload> payload = std::make_shared<wire::Payload>();
};

void write(const RadiographRequest& asked, Written& out) {
  const RadiographJob& job = asked.job;
  const runtime::XRaySetup& setup = job.setup.here;
  v1::Radiograph& picture = *out.envelope.mutable_radiograph();
  picture.set_pose_sequence(job.request.sequence);
  if (job.volume) picture.set_volume(*job.volume);
  const runtime::Exposure exposure = runtime::fitted(asked.exposure, job.integrals);
  *picture.mutable_picture() = append_picture(asked, exposure, *out.payload);
  picture.set_columns(static_cast<std::uint32_t>(setup.detector.pixels[0]));
  picture.set_rows(static_cast<std::uint32_t>(setup.detector.pixels[1]));
  wire::to_proto(setup.source, *picture.mutable_setup()->mutable_source());
  wire::to_proto(setup.detector.centre, *picture.mutable_setup()->mutable_detector());
  wire::to_proto(setup.detector.right, *picture.mutable_setup()->mutable_right());
  wire::to_proto(setup.detector.down, *picture.mutable_setup()->mutable_down());
  picture.set_width(setup.detector.size_mm[0]);
  picture.set_height(setup.detector.size_mm[1]);
  picture.set_source_to_detector(setup.source_to_detector());
  picture.set_source_to_target(job.setup.source_to_target);
  picture.set_low(exposure.low);
  picture.set_high(exposure.high);
  picture.set_largest(*std::max_element(job.integrals.begin(), job.integrals.end()));
  *picture.mutable_timings() = job.timings;
}

void on_made(Client& client, const RadiographRequest& asked, Written& written) {
  client.pending().radiograph.reset();
  if (client.over()) return;
  if (!asked.job.status.ok()) return client.answer_status(asked.id, asked.job.status);
  client.answer(asked.id, std::move(written.envelope), std::move(written.payload));
}

}  // namespace

Status handle_render_radiograph(Client& client, const v1::RenderRadiograph& render, const Request& request) {
  if (client.pending().radiograph)
    return {StatusCode::resource_exhausted,
            "radiograph: one is being made for this connection (wait for it)"};
  const Session& session = *client.session();
  const auto asked = std::make_shared<RadiographRequest>();
  asked->id = request.id();
  RadiographJob& job = asked->job;
  job.model = session.model();
  Status status = guarded("radiograph", [&] { return read_request(render, job.model->model(), *asked); });
  if (!status.ok()) return status;
  job.request = session.poses().present();
  job.request.arrived = Clock::now();
  job.most_voxels = client.registry().limits().volume_voxels;
  job.kept = client.kept_share();
  client.pending().radiograph.emplace();
  job.stop = client.pending().radiograph->get_token();
  const auto written = std::make_shared<Written>();
  client.registry().executor().run(
      Service::volumes,
      [asked, written] {
        run(asked->job);
        if (!asked->job.status.ok()) return;
        asked->job.status = guarded("radiograph", [&] {
          write(*asked, *written);
          return Status{};
        });
      },
      client.callback([asked, written](Client& asking) { on_made(asking, *asked, *written); }),
      client.account());
  return {};
}

}  // namespace ecorche::server
