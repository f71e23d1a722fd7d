// SPDX-License-Identifier: Apache-2.0
#include <ecorche/preprocess/pipeline.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <mutex>
#include <optional>
#include <span>
#include <sstream>

#include <ecorche/model_file/model_file.hpp>
#include "core/platform/process.hpp"
#include "preprocess/bind_tissues.hpp"
#include "preprocess/bounds.hpp"
#include "preprocess/cache/kept_stage.hpp"
#include "preprocess/check/joints.hpp"
#include "preprocess/check/lost_segments.hpp"
#include "preprocess/check/touching_limbs.hpp"
#include "preprocess/cor/centres.hpp"
#include "preprocess/materials.hpp"
#include "preprocess/parted_weights.hpp"
#include "preprocess/parting/cut_contacts.hpp"
#include "preprocess/provenance.hpp"
#include "preprocess/rig/fit_rig.hpp"
#include "preprocess/skin_caps.hpp"
#include "preprocess/tet/default_size.hpp"
#include "preprocess/tet/mesher.hpp"
#include "preprocess/tet/relax_slivers.hpp"
#include "preprocess/tet/short_edges.hpp"
#include "preprocess/thin/attach_by_weights.hpp"
#include "preprocess/thin/body_spheres.hpp"
#include "preprocess/thin/thinning.hpp"
#include "preprocess/voxel/voxelize.hpp"
#include "preprocess/weights/rigid_bones.hpp"

namespace ecorche::preprocess {
namespace {

// The stages of a run, in order; spheres only where they are asked for.
std::vector<std::string_view> stage_names(const Options& options) {
  std::vector<std::string_view> names{"rig", "voxelize", "mesh", "weights", "cor", "mapping", "certificate"};
  if (options.spheres_tp) names.insert(names.begin() + 2, "spheres");
  return names;
}

// Announces, times and measures the stages, in the order of their names.
class Stages {
 public:
  Stages(std::vector<std::string_view> names, const Context& context, const Hooks& hooks,
         std::vector<StageTime>& times)
      : names_(std::move(names)), context_(context), hooks_(hooks), times_(times) {}

  /// `stage()`.
  template <class F>
  auto operator()(F&& stage) {
    return timed([&](std::string_view, bool&) { return stage(); });
  }

  /// `stage(context)`, or what an earlier run kept of it: all that it reads are the `inputs`.
  template <class F, class... Inputs>
  auto kept(F&& stage, const Inputs&... inputs) {
    return timed([&](std::string_view name, bool& found) {
      using Value = decltype(stage(context_));
      if (hooks_.store == nullptr) return stage(context_);
      const std::string key = cache::key(*hooks_.store, name, inputs...);
      std::optional<Value> value = cache::take<Value>(*hooks_.store, key, context_);
      found = value.has_value();
      return found ? std::move(*value) : cache::make_and_keep(*hooks_.store, key, context_, stage);
    });
  }

 private:
  template <class F>
  auto timed(F&& stage) {
    const std::string_view name = names_.at(times_.size());
    if (hooks_.on_stage) {
      hooks_.on_stage(name, static_cast<int>(times_.size()), static_cast<int>(names_.size()));
    }
    context_.check_stop();
    bool found = false;
    const auto start = std::chrono::steady_clock::now();
    auto made = stage(name, found);
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    times_.push_back({std::string(name), spent.count(), peak_rss_mib(), found});
    context_.check_stop();
    return made;
  }

  std::vector<std::string_view> names_;
  const Context& context_;
  const Hooks& hooks_;
  std::vector<StageTime>& times_;
};

// `work()`; where it refuses and the mesh has tets to blame, they are shown.
template <class F, class M>
auto showing_worst_tets(const Hooks& hooks, F&& work, M&& mesh) {
  try {
    return work();
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::data || !hooks.on_refusal) throw;
    throw blaming_worst_tets(error, mesh(), hooks.on_refusal);
  }
}

std::string describe(const tet::SliverReport& slivers) {
  std::ostringstream line;
  line << slivers.before << " tets had angles beyond 10 to 165 degrees, " << slivers.after
       << " still have; their nodes moved by at most " << slivers.largest_move_mm << " mm, on surfaces by "
       << slivers.largest_surface_move_mm << " mm";
  return line.str();
}

std::string describe(const tet::ShortEdges& edges) {
  std::ostringstream line;
  line << edges.before << " edges were too short for single precision, the shortest " << edges.shortest_mm
       << " mm, " << edges.after << " still are; the shortest is " << edges.then_mm << " mm now";
  return line.str();
}

template <class T>
void check_range(std::string_view option, T value, const Options::Range<T>& range) {
  if (value >= range.low && value <= range.high) return;  // false for NaN
  std::ostringstream what, mend;
  what << value << " is out of range";
  mend << "give " << range.low << " to " << range.high;
  throw Error(ErrorKind::usage, std::string(option), what.str(), mend.str());
}

// Before anything slow starts.
void check_options(const Options& options) {
  if (options.voxel_mm != 0) check_range("--voxel", options.voxel_mm, Options::voxel_range);
  if (options.max_tets != 0) check_range("--max-tets", options.max_tets, Options::tets_range);
  check_range("--max-nodes", options.max_nodes, Options::nodes_range);
  check_range("--cor-sigma", options.cor_sigma, Options::sigma_range);
  constexpr Options::Range<double> tp_range{thin::least_thinness, thin::most_thinness};
  if (options.spheres_tp) check_range("--spheres", *options.spheres_tp, tp_range);
}

// The row of the segment that moves each bone. The rig holds the segments of all bones: see
// rig::present_part.
std::vector<std::int32_t> owners(const Case& patient, const Skeleton& skeleton) {
  std::vector<std::int32_t> rows;
  for (const CaseBone& bone : patient.bones) rows.push_back(skeleton.find_segment(bone.segment));
  return rows;
}

std::vector<ModelVolume> gather_volumes(const Case& patient) {
  std::vector<ModelVolume> volumes;
  for (const CaseVolume& v : patient.volumes) volumes.push_back({v.name, v.image, v.background, false, {}});
  if (!patient.labels) return volumes;
  volumes.push_back({"labels", patient.labels->image, 0, true, patient.labels->table});
  for (std::size_t layer = 0; layer < patient.labels->overlaps.size(); ++layer) {
    volumes.push_back({"labels_" + std::to_string(layer + 2), patient.labels->overlaps[layer], 0, true,
                       patient.labels->table});
  }
  return volumes;
}

void warn_of_contacts(const Case& patient, const Model& model, const Context& context) {
  const double cube = check::cube_mm(model.nodes, model.tets);
  std::string line;
  for (const check::Touch& touch : check::touching_limbs(model))
    line += (line.empty() ? "" : "; ") + check::describe(touch, model.rig.skeleton);
  if (!line.empty()) context.warn(line + " (" + check::parting_advice(cube) + ")");
  if (!patient.labels || !patient.labels->apart) return;
  const double gap = patient.labels->apart->gap_mm;
  if (gap >= 1.5 * cube) return;
  std::ostringstream out;
  out.precision(3);
  out << patient.labels->apart->where << ".gap_mm: " << gap
      << " mm are less than one and a half of the tets' cubes of " << cube
      << " mm, which bridge it (a gap of " << 1.5 * cube << " mm, or --max-tets "
      << std::llround(
             std::ceil(static_cast<double>(model.tet_count()) * std::pow(1.5 * cube / gap, 3) / 1e5) * 1e5)
      << ", keeps limbs apart)";
  context.warn(out.str());
}

// The members that only the solver knows go first; `measure` copies them.
Certificate certify(const Model& model, const Context& context) {
  const Certificate certificate = measure(model, context);
  const std::vector<std::string> broken = broken_bounds(certificate, body_size(model));
  if (!broken.empty()) {
    std::string what = "the model breaks its bounds: " + broken[0];
    for (std::size_t i = 1; i < std::min<std::size_t>(broken.size(), 3); ++i) what += "; " + broken[i];
    throw Error(
        ErrorKind::data, "certificate", what,
        broken[0].starts_with("max_outside_mm")
            ? "a part thinner than a tet, or a surface in another frame: more tets by --max-tets; ecorche "
              "check says which lie outside of the skin"
            : "run ecorche check on the case, or try another --mesher or --voxel");
  }
  return certificate;
}

}  // namespace

double peak_rss_mib() {
  return static_cast<double>(platform::peak_memory_bytes()) / (1 << 20);
}

Result run(const Case& patient, const Options& options, const Context& outer, const Hooks& hooks) {
  check_options(options);
  const std::string_view mesher_name = options.mesher.empty() ? tet::mesher_names().front() : options.mesher;
  const std::unique_ptr<tet::Mesher> mesher = tet::make_mesher(mesher_name);
  const weights::Kind kind = weights::kind_from_name(options.weights);
  weights::make_solver(options.solver);  // refuses an unknown name now, not after the mesher

  Result result;
  Model& model = result.model;
  std::mutex mutex;
  Context context = outer;
  context.log = [&](LogLevel level, std::string_view line) {
    const std::lock_guard lock(mutex);
    if (level == LogLevel::warning) result.warnings.emplace_back(line);
    if (outer.log) outer.log(level, line);
  };
  Stages stage(stage_names(options), context, hooks, result.stages);

  model.name = patient.name;
  check::refuse(check::size_findings(patient));
  model.rig = stage.kept([&](const Context& inner) { return rig::fit(patient, inner); }, patient,
                         RigRequest{patient});
  {
    const check::Inside in_skin(patient.skin);
    check::refuse(check::joint_findings(patient, model.rig, in_skin, context));
    check::refuse(check::lost_segments(patient, in_skin));
  }
  if (hooks.on_rig) hooks.on_rig(model.rig);
  model.bone_segment = owners(patient, model.rig.skeleton);
  for (const CaseBone& bone : patient.bones) model.bone_names.push_back(bone.name);

  std::optional<Image> labels = stage.kept(
      [&](const Context& inner) {
        voxel::Options o;
        o.voxel_mm = options.voxel_mm;
        return voxel::voxelize(patient, o, inner);
      },
      patient, options.voxel_mm);
  const double voxel_mm = labels->grid.spacing[0];
  if (options.spheres_tp) {
    model.spheres.push_back(stage.kept(
        [&](const Context& inner) {
          return thin::body_spheres(*labels, model.rig.skeleton, *options.spheres_tp, inner);
        },
        *labels, model_file::rig_digest(model.rig), *options.spheres_tp));
  }

  const std::int64_t max_tets =
      options.max_tets != 0 ? options.max_tets : tet::default_tets(patient, *labels);
  if (options.max_tets == 0)
    context.info("at most " + std::to_string(max_tets) +
                 " tets, after the case's vertices and voxels (--max-tets)");
  std::optional<weights::RigidBones> made = stage.kept(
      [&](const Context& inner) {
        tet::Options o;
        o.max_tets = max_tets;
        o.max_nodes = options.max_nodes;
        TetMesh mesh = mesher->mesh({patient, *labels}, o, inner);
        const tet::SliverReport slivers = tet::relax_slivers(mesh, {}, inner);
        if (slivers.before > 0) inner.info(describe(slivers));
        const tet::ShortEdges edges = tet::lengthen_short_edges(mesh);
        if (edges.before > 0) inner.info(describe(edges));
        tet::canonicalize(mesh);
        return weights::rigid_bones(std::move(mesh), patient, model.bone_segment, inner);
      },
      patient, *labels, model.bone_segment, mesher_name, max_tets, options.max_nodes);
  TetMesh* const mesh = &made->mesh;

  std::string solver_name;
  parting::Parting parting;
  {
    weights::Options o;
    o.solver = options.solver;
    o.kind = kind;
    PartedWeights made_weights = showing_worst_tets(
        hooks,
        [&] {
          return stage.kept(
              [&](const Context& inner) {
                return parted_weights(*mesh, patient, model.rig, model.bone_segment, *labels, o, inner);
              },
              patient, *mesh, model.rig, model.bone_segment, *labels, ContactRequest{patient}, options.solver,
              options.weights);
        },
        [&]() -> const TetMesh& { return *mesh; });
    model.weights = std::move(made_weights.solved.weights);
    model.certificate = made_weights.solved.certificate;
    solver_name = made_weights.solved.solver;
    parting = std::move(made_weights.parting);
  }
  labels.reset();  // each value goes when its last reader is done
  const bool parted = !parting.faces.empty();
  model.nodes = (parted ? parting.V : mesh->V).cast<float>();
  if (parted)
    model.tets = parting.T;
  else
    model.tets = std::move(mesh->T);
  model.tet_label = std::move(mesh->label);
  model.contested = std::move(made->contested);
  made.reset();
  for (VolumetricSkeleton& spheres : model.spheres) {
    if (options.spheres_by == "weights") spheres.segment = thin::attach_by_weights(spheres, model, context);
  }

  model.cor = stage.kept(
      [&](const Context& inner) {
        return cor::centres(model.nodes, model.tets, model.weights, model.segment_count(),
                            {options.cor_sigma}, inner);
      },
      model.nodes, model.tets, model.weights, model.segment_count(), options.cor_sigma);
  std::vector<Tissue> tissues = gather_tissues(patient, model.bone_segment);
  model.tissues = stage.kept(
      [&](const Context& inner) { return bind_tissues(std::move(tissues), model, parting, voxel_mm, inner); },
      tissues, model.nodes, model.tets, parting, voxel_mm);
  model.materials = materials_of(patient, model, context);
  model.volumes = gather_volumes(patient);
  Options used = options;
  used.max_tets = max_tets;
  model.provenance = provenance(patient, used, mesher_name, solver_name, voxel_mm);
  if (std::string caps = patient.labels ? caps_text(patient.skin, patient.labels->image.grid) : "";
      !caps.empty())
    model.provenance["skin_caps"] = std::move(caps);
  if (parted) {
    model.provenance["cut_contacts"] = parting::cut_contacts_text(parting.contacts, model.rig.skeleton);
    for (const parting::CutContact& contact : parting::cut_contacts(model))
      context.info(parting::describe(contact));
  }
  model.certificate = showing_worst_tets(
      hooks, [&] { return stage([&] { return certify(model, context); }); },
      [&] {
        return TetMesh{model.nodes.cast<double>(), model.tets, model.tet_label};
      });
  warn_of_contacts(patient, model, context);
  return result;
}

}  // namespace ecorche::preprocess
