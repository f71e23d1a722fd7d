// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/values/case.hpp>
#include <ecorche/version.hpp>
#include "clients/c/guard.hpp"
#include "clients/c/objects.hpp"

namespace ecorche::c {

OpenModel::OpenModel(std::shared_ptr<const Model> of)
    : model(std::move(of)),
      poser(model),
      identity(model_file::identity(*model)),
      angles(angle_rows(skeleton())) {}

namespace {

ecorche_code no_tissue(std::uint32_t tissue, std::size_t count) {
  return fail(ECORCHE_INVALID_ARGUMENT,
              "tissue " + std::to_string(tissue) + ": the model has " + std::to_string(count) + " of them");
}

}  // namespace
}  // namespace ecorche::c

using namespace ecorche;

unsigned ecorche_abi_version(void) {
  return ECORCHE_ABI_VERSION;
}

const char* ecorche_version(void) {
  return ECORCHE_VERSION;
}

const char* ecorche_error_message(void) {
  return c::last_error();
}

ecorche_code ecorche_model_open(const char* path, ecorche_model** out) {
  if (path == nullptr || out == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "path, out: is null");
  return c::guarded([&] {
    auto model = std::make_shared<const Model>(model_file::read(std::filesystem::path(path), Context{}));
    *out = new ecorche_model{std::make_shared<const c::OpenModel>(std::move(model))};
    return ECORCHE_OK;
  });
}

void ecorche_model_close(ecorche_model* model) {
  delete model;
}

const char* ecorche_model_name(const ecorche_model* model) {
  return model == nullptr ? nullptr : model->open->model->name.c_str();
}

uint64_t ecorche_model_identity(const ecorche_model* model) {
  return model == nullptr ? 0 : model->open->identity;
}

uint32_t ecorche_model_tissue_count(const ecorche_model* model) {
  return model == nullptr ? 0 : static_cast<uint32_t>(model->open->model->tissues.size());
}

ecorche_code ecorche_model_tissue(const ecorche_model* model, uint32_t tissue, ecorche_tissue_info* out) {
  if (model == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "model: is null");
  return c::guarded([&] {
    const std::vector<Tissue>& all = model->open->model->tissues;
    if (tissue >= all.size()) return c::no_tissue(tissue, all.size());
    const Tissue& t = all[tissue];
    ecorche_tissue_info info = ECORCHE_TISSUE_INFO_INIT;
    info.name = t.name.c_str();
    info.group = group_name(t.group).data();
    info.vertex_count = static_cast<uint32_t>(t.V.rows());
    info.triangle_count = static_cast<uint32_t>(t.F.rows());
    info.triangles = reinterpret_cast<const uint32_t*>(t.F.data());
    info.rest = t.V.data();
    info.segment = t.segment;
    return c::fill(out, info);
  });
}

int32_t ecorche_model_find_tissue(const ecorche_model* model, const char* name) {
  if (model == nullptr || name == nullptr) return -1;
  const std::vector<Tissue>& all = model->open->model->tissues;
  for (std::size_t t = 0; t < all.size(); ++t) {
    if (all[t].name == name) return static_cast<int32_t>(t);
  }
  return -1;
}

uint32_t ecorche_model_segment_count(const ecorche_model* model) {
  return model == nullptr ? 0 : static_cast<uint32_t>(model->open->model->segment_count());
}

ecorche_code ecorche_model_segment(const ecorche_model* model, uint32_t segment, ecorche_segment_info* out) {
  if (model == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "model: is null");
  return c::guarded([&] { return c::fill_segment(model->open->model->rig, segment, out); });
}

int32_t ecorche_model_find_segment(const ecorche_model* model, const char* name) {
  return model == nullptr ? -1 : c::find_segment(model->open->skeleton(), name);
}

uint32_t ecorche_model_angle_count(const ecorche_model* model) {
  return model == nullptr ? 0 : static_cast<uint32_t>(model->open->angles.size());
}

ecorche_code ecorche_model_angle(const ecorche_model* model, uint32_t angle, ecorche_angle_info* out) {
  if (model == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "model: is null");
  return c::guarded([&] { return c::fill_angle(model->open->skeleton(), model->open->angles, angle, out); });
}
