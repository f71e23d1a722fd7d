// SPDX-License-Identifier: Apache-2.0
// `ecorche stream`: a client that plays a clip against a server, checks what comes back, and measures.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include <ecorche/client/client.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/version.hpp>
#include <ecorche/wire/convert.hpp>
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/motion_source.hpp"
#include "app/replay.hpp"
#include "app/stream_check.hpp"
#include "app/stream_text.hpp"
#include "app/token_file.hpp"

namespace ecorche::app {
namespace {

using client::Client;
using client::Clock;

struct StreamSettings {
  std::string address;
  std::string open, session;
  MotionChoice motion;
  double rate = 90, max_rate = 0, seconds = 10;
  std::vector<std::string> tissues;
  std::string volume;
  std::string skinning = "cor", sampling = "trilinear", encoding = "f32";
  bool quality = false, normals = false;
  std::string model;
  std::uint64_t check_every = 1;
  client::Access access;
  std::string token_file;
  std::string replay;
};

// After the last pose: how long a silence ends the wait for its frames.
constexpr std::chrono::seconds kSilence{3};
// For the server to hear that this client goes.
constexpr std::chrono::milliseconds kGoodbye{500};

double milliseconds(Clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

// What arrived of one kind of frame.
struct Arrivals {
  std::uint64_t frames = 0;
  std::vector<double> latency_ms;  // one per pose whose frame came

  nlohmann::json percentiles() {
    std::sort(latency_ms.begin(), latency_ms.end());
    // Nearest rank.
    const auto at = [&](double share) {
      return latency_ms[static_cast<std::size_t>(
          std::lround(share * static_cast<double>(latency_ms.size() - 1)))];
    };
    if (latency_ms.empty()) return nullptr;
    return {{"p50", at(0.5)}, {"p90", at(0.9)}, {"p99", at(0.99)}, {"max", latency_ms.back()}};
  }
};

v1::Skinning skinning_to_proto(runtime::Skinning skinning) {
  switch (skinning) {
    case runtime::Skinning::lbs:
      return v1::SKINNING_LBS;
    case runtime::Skinning::dqs:
      return v1::SKINNING_DQS;
    case runtime::Skinning::cor:
      break;
  }
  return v1::SKINNING_COR;
}

v1::Encoding encoding_to_proto(const std::string& encoding) {
  if (encoding == "u16") return v1::ENCODING_U16;
  return encoding == "u16-delta" ? v1::ENCODING_U16_DELTA : v1::ENCODING_F32;
}

// The motion's poses, or the rest pose alone; one after another, `rate` times a second.
class Motion {
 public:
  Motion(const StreamSettings& settings, const Rig& rig, const Program& program)
      : rate_(settings.rate), rest_(Pose::rest(rig.skeleton.segments.size())) {
    if (settings.motion.file.empty()) return;
    source_ = open_motion(program, settings.motion, rig);
    if (source_->retarget() == nullptr) return;
    for (const std::string& segment : source_->retarget()->still_segments)
      program.note("note: nothing in the clip moves " + segment);
  }

  // The motion loops; a pose stays until the next frame is due.
  Pose at(std::uint64_t sequence) const {
    if (!source_) return rest_;
    const double seconds = static_cast<double>(sequence) / rate_;
    return source_->at(static_cast<std::size_t>(seconds / source_->frame_seconds()) % source_->frames());
  }

 private:
  double rate_;
  Pose rest_;
  std::unique_ptr<MotionSource> source_;
};

// One run of the command.
class Stream {
 public:
  Stream(const StreamSettings& settings, const Program& program)
      : settings_(settings),
        program_(program),
        skinning_(runtime::skinning_from_name(settings.skinning)),
        client_(wire::parse_address(settings.address), std::string("ecorche stream ") + ECORCHE_VERSION,
                settings.access) {}
  // Else the server keeps its place for it: nobody else could pose the session meanwhile.
  ~Stream() { client_.leave(Clock::now() + kGoodbye); }

  int run() {
    open();
    if (!settings_.model.empty() && !prepare_check()) return 1;
    Rig rig;
    if (const Status status = wire::from_proto(opened_.skeleton(), rig); !status.ok()) {
      throw Error(ErrorKind::protocol, settings_.address, status.message,
                  "use a client of the server's version");
    }
    const Motion motion(settings_, rig, program_);
    rest_ = Pose::rest(rig.skeleton.segments.size());
    subscribe();
    play(motion);
    return report();
  }

 private:
  void open() {
    v1::Envelope request;
    request.mutable_open_model()->set_model(settings_.open);
    request.mutable_open_model()->set_session(settings_.session);
    request.mutable_open_model()->set_without_triangles(true);
    wire::Frame answer = client_.call(std::move(request));
    opened_ = std::move(*answer.envelope.mutable_model_opened());
    if (opened_.role() != v1::ROLE_CONTROLLER) {
      throw Error(ErrorKind::refused, settings_.address,
                  "another client controls session '" + settings_.session + "'",
                  "choose another --session, or wait until it has left");
    }
    before_ = sequence_ = settled_ = opened_.last_sequence();
  }

  // False when the server's model cannot even be compared.
  bool prepare_check() {
    auto model =
        std::make_shared<const Model>(model_file::read(settings_.model, program_.context("read model")));
    if (model_file::topology_digest(*model) != opened_.topology_digest() ||
        model_file::rig_digest(model->rig) != opened_.rig_digest()) {
      program_.note("mismatch: the server's model '" + opened_.model() +
                    "' has other tissues or another skeleton than " + settings_.model);
      program_.result("the models differ", {{"checked", 0}, {"mismatches", 1}});
      return false;
    }
    same_model_ = model_file::identity(*model) == opened_.identity();
    if (!same_model_)
      program_.note("mismatch: the server's model '" + opened_.model() + "' is not " + settings_.model);
    const auto sampling =
        settings_.sampling == "nearest" ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
    check_ = std::make_unique<StreamCheck>(std::move(model), skinning_, sampling,
                                           [this](std::string_view line) { program_.note(line); });
    return true;
  }

  void subscribe() {
    v1::Envelope mesh;
    mesh.mutable_subscribe()->set_max_rate(settings_.max_rate);
    v1::MeshSelection& selection = *mesh.mutable_subscribe()->mutable_mesh();
    selection.mutable_tissues()->Assign(settings_.tissues.begin(), settings_.tissues.end());
    selection.set_encoding(encoding_to_proto(settings_.encoding));
    selection.set_normals(settings_.normals);
    selection.set_quality(settings_.quality);
    client_.call(std::move(mesh));
    if (settings_.volume.empty()) return;
    v1::Envelope volume;
    volume.mutable_subscribe()->mutable_volume()->set_volume(settings_.volume);
    volume.mutable_subscribe()->mutable_volume()->set_nearest(settings_.sampling == "nearest");
    client_.call(std::move(volume));
  }

  void play(const Motion& motion) {
    const auto period =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / settings_.rate));
    const auto start = Clock::now();
    const auto end =
        start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(settings_.seconds));
    started_ = last_frame_ = start;
    auto due = start;
    while (Clock::now() < end) {
      check_stop();
      if (Clock::now() >= due) {
        send_pose(motion.at(sequence_ - before_));
        due += period;
        // What could not be sent in time is not made up for: the pace is a pace.
        if (due < Clock::now()) due = Clock::now();
      }
      if (auto frame = client_.receive(std::min(due, end))) take(std::move(*frame));
    }
    while (settled_ < sequence_) {
      check_stop();
      auto frame = client_.receive(Clock::now() + kSilence);
      if (!frame) break;
      take(std::move(*frame));
    }
  }

  void check_stop() const { program_.context("stream").check_stop(); }

  void send_pose(const Pose& pose) {
    v1::Envelope envelope;
    v1::PoseUpdate& update = *envelope.mutable_pose_update();
    update.set_sequence(++sequence_);
    update.set_rig_digest(opened_.rig_digest());
    update.set_skinning(skinning_to_proto(skinning_));
    wire::to_proto(pose, update);
    sent_.emplace(sequence_, Sent{pose, Clock::now()});
    client_.send(envelope);
  }

  void take(wire::Frame frame) {
    const v1::Envelope& envelope = frame.envelope;
    if (envelope.has_pose_ack()) return take_ack(envelope.pose_ack());
    if (envelope.has_mesh_frame()) {
      const v1::MeshFrame& mesh = envelope.mesh_frame();
      if (mesh.topology_digest() != opened_.topology_digest()) {
        throw Error(ErrorKind::protocol, settings_.address, "a frame of another topology",
                    "use a server that keeps the protocol");
      }
      if (mesh.quality().verdict() == v1::PoseQuality::VERDICT_WARN) ++warned_;
      decode(mesh, frame.payload);
      if (settings_.volume.empty()) settled_ = std::max(settled_, mesh.pose_sequence());
      take_frame(mesh.pose_sequence(), meshes_, std::move(frame));
    } else if (envelope.has_volume_frame()) {
      const v1::VolumeFrame& volume = envelope.volume_frame();
      if (volume.status().code() != 0) throw client::ServerError("volume", volume.status());
      settled_ = std::max(settled_, volume.pose_sequence());
      take_frame(volume.pose_sequence(), volumes_, std::move(frame));
    }
  }

  // As float32 stands in the payload, only a check wants it decoded.
  void decode(const v1::MeshFrame& mesh, const wire::Payload& payload) {
    if (mesh.encoding() == v1::ENCODING_F32 && !check_) return;
    const Status status = decoder_.decode(mesh, payload, decoded_);
    if (status.ok()) return;
    v1::Status told;
    wire::to_proto(status, told);
    throw client::ServerError("frame " + std::to_string(mesh.frame()), told);
  }

  void take_ack(const v1::PoseAck& ack) {
    if (ack.status().code() != 0)
      throw client::ServerError("pose " + std::to_string(ack.sequence()), ack.status());
    skipped_ += ack.skipped();
    if (ack.clamped_size() > 0) ++clamped_;
  }

  void take_frame(std::uint64_t sequence, Arrivals& arrivals, wire::Frame frame) {
    if (before_ > 0 && sequence <= before_) return;  // somebody else's pose
    last_frame_ = Clock::now();
    ++arrivals.frames;
    const auto sent = sent_.find(sequence);
    if (sent != sent_.end()) arrivals.latency_ms.push_back(milliseconds(last_frame_ - sent->second.at));
    if (sequence != 0 && sent == sent_.end()) {
      throw Error(ErrorKind::protocol, settings_.address,
                  "a frame of pose " + std::to_string(sequence) + ", which was not sent",
                  "use a server that keeps the protocol");
    }
    if (check_ && ++offered_ % settings_.check_every == 0) {
      auto tissues = &arrivals == &meshes_ ? std::exchange(decoded_, {}) : std::vector<wire::DecodedTissue>();
      check_->add(std::move(frame), std::move(tissues), sequence == 0 ? rest_ : sent->second.pose);
    }
    // Volumes come later than the meshes of the same pose; nothing comes from before both.
    if (settings_.volume.empty() || &arrivals == &volumes_)
      sent_.erase(sent_.begin(), sent_.lower_bound(sequence));
  }

  int report() {
    const StreamCheck::Result checked = check_ ? check_->finish() : StreamCheck::Result{};
    const double seconds = std::max(1e-9, milliseconds(last_frame_ - started_) / 1000);
    const double fps = static_cast<double>(meshes_.frames) / seconds;
    nlohmann::json figures{{"server", client_.server().server()},
                           {"model", opened_.model()},
                           {"poses", sequence_ - before_},
                           {"skipped", skipped_},
                           {"clamped_poses", clamped_},
                           {"frames", meshes_.frames},
                           {"seconds", seconds},
                           {"frames_per_second", fps},
                           {"latency_ms", meshes_.percentiles()},
                           {"volume_frames", volumes_.frames},
                           {"bytes", client_.bytes_received()}};
    if (!settings_.volume.empty()) figures["volume_latency_ms"] = volumes_.percentiles();
    if (settings_.quality) figures["frames_with_warning"] = warned_;
    if (warned_ > 0) program_.warn();
    if (check_) {
      figures["same_model"] = same_model_;
      figures["checked"] = checked.checked;
      figures["mismatches"] = checked.mismatches;
    }
    program_.result(stream_text(figures, settings_.model), figures);
    if (meshes_.frames == 0)
      throw Error(ErrorKind::protocol, settings_.address, "no frame came", "see the server's log");
    return checked.mismatches > 0 || !same_model_ ? 1 : 0;
  }

  struct Sent {
    Pose pose;
    Clock::time_point at;
  };

  const StreamSettings& settings_;
  const Program& program_;
  runtime::Skinning skinning_;
  Client client_;
  v1::ModelOpened opened_;
  Pose rest_;
  wire::MeshDecoder decoder_;
  std::vector<wire::DecodedTissue> decoded_;  // the frame that came last
  std::unique_ptr<StreamCheck> check_;
  bool same_model_ = true;

  std::uint64_t before_ = 0;            // of the last pose that the session had when it was joined
  std::uint64_t sequence_ = 0;          // of the last pose sent
  std::uint64_t settled_ = 0;           // the newest pose of which everything came
  std::map<std::uint64_t, Sent> sent_;  // poses whose frames may still come
  Arrivals meshes_, volumes_;
  std::uint64_t skipped_ = 0, clamped_ = 0, warned_ = 0, offered_ = 0;
  Clock::time_point started_, last_frame_;
};

}  // namespace

void declare_stream(CLI::App& app, Program& program, Run& chosen) {
  auto settings = std::make_shared<StreamSettings>();
  CLI::App* command =
      app.add_subcommand("stream", "play a motion clip against a server, check and measure what comes back");
  command->add_option("address", settings->address, "HOST:PORT of ecorche serve")->required();
  command->add_option("--open", settings->open, "the server's name of the model; its first by default");
  command->add_option("--session", settings->session,
                      "a name that others can watch; one of one's own by default");
  command->add_option("--tls-ca", settings->access.authorities,
                      "speak TLS, with a server whose certificate one in this PEM file vouches for");
  command->add_option("--token-file", settings->token_file, "show the server the token in this file");
  command->add_option("--replay", settings->replay,
                      "play back this recording of a server, and compare every frame with what was recorded");
  add_motion_options(*command, settings->motion);
  command->add_option("--rate", settings->rate, "poses per second")
      ->check(CLI::Range(0.1, 1e5))
      ->capture_default_str();
  command->add_option("--seconds", settings->seconds, "how long")
      ->check(CLI::Range(0.01, 1e6))
      ->capture_default_str();
  command->add_option("--tissues", settings->tissues, "names, separated by commas; all by default")
      ->delimiter(',');
  command->add_option("--volume", settings->volume, "also stream this volume");
  command->add_option("--sampling", settings->sampling, "of the volume")
      ->check(CLI::IsMember({"nearest", "trilinear"}))
      ->capture_default_str();
  command->add_option("--skinning", settings->skinning, "skinning of the nodes")
      ->check(CLI::IsMember({"cor", "dqs", "lbs"}))
      ->capture_default_str();
  command->add_option("--encoding", settings->encoding, "of the meshes")
      ->check(CLI::IsMember({"f32", "u16", "u16-delta"}))
      ->capture_default_str();
  command->add_option("--max-rate", settings->max_rate, "mesh frames per second at most; 0: one per pose")
      ->check(CLI::Range(0.0, 1e5))
      ->capture_default_str();
  command->add_flag("--normals", settings->normals, "unit normals beside the positions");
  command->add_flag("--quality", settings->quality, "let the server measure the quality of every pose");
  command->add_option(
      "--model", settings->model,
      "check every frame against offline posing of this model file: float32 and volumes byte for "
      "byte, u16 within half a step");
  command->add_option("--check-every", settings->check_every, "check only every Nth frame")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 32))
      ->capture_default_str();
  command->callback([settings, &program, &chosen] {
    chosen = [settings, &program] {
      if (!settings->token_file.empty()) settings->access.token = read_token(settings->token_file);
      settings->access.session = settings->session;
      if (!settings->replay.empty())
        return replay(program, settings->replay, wire::parse_address(settings->address), settings->access);
      return Stream(*settings, program).run();
    };
  });
}

}  // namespace ecorche::app
