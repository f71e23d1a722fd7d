// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/registry/recordings.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <new>
#include <utility>

#include "core/files/atomic_file.hpp"
#include "core/values/identifier.hpp"
#include "runtime/server/resources/shares.hpp"

namespace ecorche::server {
namespace {

// Recordings that can be played, of a rig; the oldest goes.
constexpr std::ptrdiff_t kMostPlayable = 16;
// Recordings that an address may begin in one go.
constexpr double kBurst = 4;
// Where so much of a recording waits for the disk, it ends there.
constexpr std::size_t kMostWaiting = std::size_t{8} << 20;

bool is_recording(const std::filesystem::path& path) {
  return path.extension() == ".ecrec" || path.string().ends_with(".ecrec.part");
}

// The clip that a whole recording shows; none where it cannot be read.
Clip read_clip(const std::filesystem::path& path, const std::string& name, std::size_t segments,
               std::size_t most) {
  const std::string bytes = files::read_text(path, most);
  return clip_of(std::as_bytes(std::span(bytes)), name, segments);
}

}  // namespace

Recordings::Recordings(Executor& executor, const Options& options)
    : executor_(executor), options_(options), begun_(options.limits.recordings_per_minute / 60, kBurst) {}

Status Recordings::begin(Session& session, const std::string& name, const std::string& address) {
  std::filesystem::path path;
  if (Status status = check(name, address, path); !status.ok()) return status;
  auto recording = std::make_shared<Recording>(name, *session.model(), "ecorche " + options_.version,
                                               options_.limits.record_bytes);
  recording->put({.file = std::make_shared<RecordingFile>(path), .owner = address});
  running_.push_back(recording);
  files_[address].push_back(path);
  session.recorder().start(std::move(recording));
  return {};
}

Status Recordings::check(const std::string& name, const std::string& address, std::filesystem::path& path) {
  if (!is_identifier(name))
    return {StatusCode::invalid_argument, "record: a name is 1 to 64 of a-z, 0-9 and _ (mend the name)"};
  path = options_.record_folder / (name + ".ecrec");
  std::erase_if(running_, [](const auto& one) { return one.expired(); });
  std::uint64_t running = 0, own = 0;
  for (const auto& one : running_) {
    const std::shared_ptr<const Recording> recording = one.lock();
    if (!recording) continue;
    ++running;
    own += recording->place().owner == address ? 1 : 0;
    if (recording->name() == name) {
      return {StatusCode::already_exists,
              "record: another session's recording '" + name + "' runs (choose another name)"};
    }
  }
  std::error_code ec;
  for (const auto& taken : {path, RecordingFile::part_of(path)}) {
    if (std::filesystem::exists(taken, ec))
      return {StatusCode::already_exists,
              "record: there is a recording '" + name + "' (choose another name)"};
  }
  const Limits& limits = options_.limits;
  if (running >= limits.recordings) {
    return {StatusCode::resource_exhausted,
            "record: " + std::to_string(running) + " recordings run already (try again later)"};
  }
  if (!address.empty() && own >= portion(limits.recordings, limits.peer_share)) {
    return {StatusCode::resource_exhausted,
            "record: " + std::to_string(own) + " recordings of your address run already (end one first)"};
  }
  if (Status status = check_folder(address); !status.ok()) return status;
  if (!address.empty() && !begun_.take(address, Clock::now())) {
    return {StatusCode::resource_exhausted,
            "record: your address begins them too fast (wait a minute, or raise --recording-rate)"};
  }
  return {};
}

Status Recordings::check_folder(const std::string& address) {
  const Limits& limits = options_.limits;
  std::vector<std::filesystem::path>& own = files_[address];
  // One that runs has no file before its first pose.
  const auto runs = [&](const std::filesystem::path& path) {
    return std::any_of(running_.begin(), running_.end(), [&](const auto& one) {
      const std::shared_ptr<const Recording> recording = one.lock();
      return recording && recording->name() == path.stem();
    });
  };
  std::erase_if(own, [&](const auto& path) {
    std::error_code ec;
    return !runs(path) && !std::filesystem::exists(path, ec) &&
           !std::filesystem::exists(RecordingFile::part_of(path), ec);
  });
  const bool too_many = !address.empty() && own.size() >= portion(limits.recording_files, limits.peer_share);
  if (own.empty()) files_.erase(address);
  if (too_many) {
    return {StatusCode::resource_exhausted,
            "record: your address' share of the server's folder is full (ask who runs it)"};
  }
  if (evict() < limits.recording_files) return {};
  return {StatusCode::resource_exhausted, "record: the server's folder is full (ask who runs it)"};
}

// Files in the folder. Where it is full, what is old makes way first, the oldest first; never what runs.
std::size_t Recordings::evict() const {
  namespace fs = std::filesystem;
  std::error_code ec;
  std::size_t count = 0;
  std::vector<std::pair<fs::file_time_type, fs::path>> old;
  const auto since = fs::file_time_type::clock::now() -
                     std::chrono::duration_cast<fs::file_time_type::duration>(
                         std::chrono::duration<double>(86400 * options_.limits.recording_days));
  for (fs::directory_iterator at(options_.record_folder, ec), end; !ec && at != end; at.increment(ec)) {
    ++count;
    std::error_code unknown;
    const auto when = at->last_write_time(unknown);
    const bool plain = at->symlink_status(unknown).type() == fs::file_type::regular;
    if (!unknown && plain && when < since && is_recording(at->path())) old.emplace_back(when, at->path());
  }
  std::sort(old.begin(), old.end());
  for (const auto& [when, path] : old) {
    if (count < options_.limits.recording_files) break;
    if (fs::remove(path, ec)) --count;
  }
  return count;
}

void Recordings::write_pending(Recording& recording) {
  const std::shared_ptr<RecordingFile> file = recording.place().file;
  if (!file) return;
  std::string bytes = recording.take();
  if (bytes.empty()) return;
  file->expect(bytes.size());
  if (file->expected() > kMostWaiting) recording.stop_growing();
  executor_.submit(Service::files, [file, bytes = std::move(bytes)] { file->append(bytes); });
}

void Recordings::tick(Clock::time_point now) {
  if (now - written_ < written_every) return;
  written_ = now;
  for (const auto& one : running_) {
    if (const auto recording = one.lock()) write_pending(*recording);
  }
}

void Recordings::finish(Session& session, std::function<void(const Status&)> done) {
  session.recorder().stop([this, recording = session.recorder().recording(), model = session.model(),
                           done = std::move(done)] { write(recording, *model, done); });
}

void Recordings::keep(Session& session) {
  if (!session.recorder().running()) return;
  finish(session, [name = session.recorder().recording()->name()](const Status& status) {
    if (!status.ok() && status.code != StatusCode::failed_precondition)
      spdlog::warn("recording {}: {}", name, status.message);
  });
}

// What was written last of a recording.
struct Recordings::Ended {
  Recordings& recordings;
  std::shared_ptr<Recording> recording;
  std::uint64_t rig_digest;
  std::size_t segments;
  std::function<void(const Status&)> done;
  std::string rest = {};
  Status status = {};
  Clip clip = {};

  // On the thread of files.
  void write(std::size_t most) noexcept {
    RecordingFile& file = *recording->place().file;
    file.append(rest);
    status = file.commit();
    try {
      if (status.ok()) clip = read_clip(file.path(), recording->name(), segments, most);
    } catch (const std::exception&) {  // it is whole, and is not played
    }
  }
  void operator()() {
    if (status.ok()) recordings.add(rig_digest, std::move(clip));
    if (status.ok() && recording->full()) {
      status = {StatusCode::resource_exhausted,
                "record: it grew to the server's limit, and is whole up to there (record less)"};
    }
    done(status);
  }
};

void Recordings::write(const std::shared_ptr<Recording>& recording, const ServedModel& model,
                       std::function<void(const Status&)> done) {
  if (recording->poses() == 0) {
    return done({StatusCode::failed_precondition,
                 "record: no pose came while it ran, so there is no file (pose, then end it)"});
  }
  recording->finish();
  const auto ended = std::make_shared<Ended>(Ended{.recordings = *this,
                                                   .recording = recording,
                                                   .rig_digest = model.opened.rig_digest(),
                                                   .segments = model.model().segment_count(),
                                                   .done = std::move(done)});
  ended->rest = recording->take();
  recording->place().file->expect(ended->rest.size());
  executor_.run(
      Service::files, [ended, most = options_.limits.record_bytes] { ended->write(most); },
      [ended] { (*ended)(); });
}

std::vector<std::shared_ptr<const Clip>> Recordings::clips(std::uint64_t rig_digest) const {
  std::vector<std::shared_ptr<const Clip>> out;
  for (const Playable& one : playable_) {
    if (one.rig_digest == rig_digest) out.push_back(one.clip);
  }
  return out;
}

void Recordings::add(std::uint64_t rig_digest, Clip clip) {
  if (clip.poses.empty()) return;
  const Pose& pose = clip.poses.front();
  const std::uint64_t bytes =
      clip.poses.size() * (sizeof(Pose) + sizeof(double) + pose.rotation.size() * sizeof(pose.rotation[0]) +
                           pose.translation.size() * sizeof(pose.translation[0]));
  playable_.push_back({rig_digest, std::make_shared<const Clip>(std::move(clip)), bytes});
  const auto of_rig = [&](const Playable& one) { return one.rig_digest == rig_digest; };
  if (std::count_if(playable_.begin(), playable_.end(), of_rig) > kMostPlayable)
    playable_.erase(std::find_if(playable_.begin(), playable_.end(), of_rig));
  std::uint64_t sum = 0;
  for (const Playable& one : playable_) sum += one.bytes;
  while (sum > options_.limits.record_bytes) {
    sum -= playable_.front().bytes;
    playable_.erase(playable_.begin());
  }
}

}  // namespace ecorche::server
