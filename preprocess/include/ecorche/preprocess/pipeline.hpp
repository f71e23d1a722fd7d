// SPDX-License-Identifier: Apache-2.0
// All of the preparation, in order: rig, voxels, tets, weights, centres, mapping, certificate.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/preprocess/stage_store.hpp>
#include <ecorche/preprocess/worst_tets.hpp>
#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::preprocess {

/// How a body is prepared.
struct Options {
  /// An inclusive range of an option; the command line and `run` refuse what lies beyond.
  template <class T>
  struct Range {
    T low, high;
  };
  static constexpr Range<double> voxel_range{1e-3, 500};  ///< mm, or 0
  static constexpr Range<std::int64_t> tets_range{1'000,
                                                  100'000'000};  ///< grids of int32 tets hold 2^31 / 4 nodes
  static constexpr Range<std::int64_t> nodes_range{500, 25'000'000};
  static constexpr Range<double> sigma_range{1e-3,
                                             0.0999};  ///< 0 < sigma < 0.1; the tables grow as 1 / sigma

  std::string mesher;         ///< empty: the build's default
  double voxel_mm = 0;        ///< 0: the finest that voxel::Options allow
  std::int64_t max_tets = 0;  ///< 0: as many as the case is worth (tet/default_size.hpp)
  std::int64_t max_nodes = 800'000;
  std::string solver = "auto";
  std::string weights = "harmonic";  ///< or `quasi-harmonic`: smoother at bones (weights/conductivity.hpp)
  double cor_sigma = 0.05;           ///< half of LeHodgins16's 0.1
  /// Thinness of the body's volumetric skeleton. None is made without it: only the deformer of spheres reads
  /// one, and a model is posed by tets unless told otherwise.
  std::optional<double> spheres_tp;
  /// What its voxels hang by: `weights` (thin/attach_by_weights.hpp) or `bones` (thin/attach.hpp).
  std::string spheres_by = "weights";
};

/// How long a stage took.
struct StageTime {
  std::string name;
  double seconds = 0;
  double peak_rss_mib = 0;  ///< of the process, at the end of the stage
  bool kept = false;        ///< taken from the store, made by an earlier run
};

/// What a preparation made.
struct Result {
  Model model;
  std::vector<StageTime> stages;
  std::vector<std::string> warnings;  ///< as they were logged, in that order
};

/// What a run tells and asks on its way. All may be left out.
struct Hooks {
  /// As each stage starts.
  std::function<void(std::string_view name, int index, int count)> on_stage = {};
  /// The rig, as soon as it is found: whoever throws here ends the run before the long stages.
  std::function<void(const Rig&)> on_rig = {};
  /// Where stages are kept from run to run. The certificate is not: it must be measured on what is there.
  StageStore* store = nullptr;
  /// Called where weights or certificate are refused and the mesh has tets to blame, with the worst of them.
  /// What it returns is put before the error's advice: where to look.
  std::function<std::string(const WorstTets&)> on_refusal = {};
};

/// Deterministic: the same case and options give the same model whatever the number of threads, and whether
/// its stages were kept or made. Throws Error{usage} for an option out of range, what the stages throw, and
/// Error{data} for a model that breaks its bounds (bounds.hpp).
Result run(const Case& patient, const Options& options, const Context& context, const Hooks& hooks = {});

/// Certificate of a model, measured on what is stored; members that only the solver knows are copied from
/// `model`. `outside` counts the vertices that are more than 6e-7 of the body's length (0.001 mm of a
/// man), or two grains of float32, from the tet to which they are bound, which is their nearest. The probe
/// pose of the bones turns every joint by 0.6 rad about (1, 2, 3), all at once, and shifts the root by 0.2 m.
Certificate measure(const Model& model, const Context& context);

/// Largest resident memory of this process so far, MiB (VmHWM of Linux; 0 where that cannot be read).
double peak_rss_mib();

}  // namespace ecorche::preprocess
