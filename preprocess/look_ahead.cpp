// SPDX-License-Identifier: Apache-2.0
#include "preprocess/look_ahead.hpp"

#include <algorithm>
#include <utility>

#include <ecorche/preprocess/pipeline.hpp>
#include "preprocess/check/touching_limbs.hpp"
#include "preprocess/parting/part_limbs.hpp"
#include "preprocess/rig/fit_rig.hpp"
#include "preprocess/tet/default_size.hpp"
#include "preprocess/tet/mesher.hpp"
#include "preprocess/tet/relax_slivers.hpp"
#include "preprocess/voxel/voxelize.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::preprocess {
namespace {

// Weights by whole limbs, which are few, tell where limbs touch as well as those of all segments.
std::vector<std::int32_t> limbs_of_bones(const Model& model) {
  const std::vector<int> limb = check::limbs_of(model.rig.skeleton);
  std::vector<std::int32_t> out;
  for (const std::int32_t segment : model.bone_segment)
    out.push_back(std::max(0, limb[static_cast<std::size_t>(segment)]));  // the trunk goes by its root
  return out;
}

// As far as weights; the skin is the only tissue.
Model half_made(const Case& patient, const Context& context) {
  const Context quiet = context.quiet();  // what the stages would warn of has its own findings
  Model model;
  model.rig = rig::fit(patient, quiet);
  for (const CaseBone& bone : patient.bones)
    model.bone_segment.push_back(model.rig.skeleton.find_segment(bone.segment));
  context.report(0.1);
  TetMesh mesh;
  {
    const Image labels = voxel::voxelize(patient, {}, quiet);
    context.report(0.2);
    tet::Options o;
    o.max_tets = tet::default_tets(patient, labels);
    mesh = tet::make_mesher("lattice")->mesh({patient, labels}, o, quiet);
  }
  tet::canonicalize(mesh);
  context.report(0.4);
  model.weights =
      weights::solve_weights(mesh, patient, limbs_of_bones(model), model.segment_count(), {}, quiet).weights;
  context.report(0.9);
  model.nodes = mesh.V.cast<float>();
  model.tets = std::move(mesh.T);
  model.tet_label = std::move(mesh.label);
  Tissue& skin = model.tissues.emplace_back();
  skin.group = Group::skin;
  skin.V = patient.skin.V.cast<float>();
  skin.F = patient.skin.F;
  return model;
}

// As parting::part_limbs will have it.
bool comes_apart(const check::Touch& touch, const CaseContacts& contacts, const parting::Joined& joined) {
  return contacts.cut && std::none_of(joined.begin(), joined.end(), [&](const auto& pair) {
           return pair == std::pair(touch.limb, touch.other_limb) ||
                  pair == std::pair(touch.other_limb, touch.limb);
         });
}

}  // namespace

std::vector<check::Finding> look_ahead(const Case& patient, const Context& context) {
  using check::Severity;
  std::vector<check::Finding> out;
  if (patient.skin.F.rows() == 0 || patient.bones.empty()) return out;
  try {
    const Model model = half_made(patient, context);
    const std::string advice = check::parting_advice(check::cube_mm(model.nodes, model.tets));
    const parting::Joined joined = parting::joined_limbs(patient.contacts, model.rig.skeleton);
    for (const check::Touch& touch : check::touching_limbs(model)) {
      const std::string& limb = model.rig.skeleton.segments[static_cast<std::size_t>(touch.limb)].name;
      const std::string what = check::what(touch, model.rig.skeleton);
      if (comes_apart(touch, patient.contacts, joined))
        out.push_back({Severity::note, limb, what + "; preprocess cuts it free", touch.at,
                       "where it has grown together, say so in the case under contacts, joined"});
      else
        out.push_back({Severity::warning, limb, what, touch.at, advice});
    }
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::data && error.kind() != ErrorKind::config) throw;
    out.push_back({Severity::error, error.where(), error.problem(), {}, error.mend()});
  }
  context.report(1);
  return out;
}

}  // namespace ecorche::preprocess
