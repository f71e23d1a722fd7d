// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <numeric>
#include <string>

#include "clients/c/guard.hpp"
#include "clients/c/objects.hpp"
#include "clients/c/space.hpp"

namespace ecorche::c {
namespace {

bool holds(const ecorche_body& body, std::uint32_t tissue) {
  return std::binary_search(body.tissues.begin(), body.tissues.end(), tissue);
}

ecorche_code bad_tissues(std::size_t count) {
  return fail(ECORCHE_INVALID_ARGUMENT, "tissues: are not ascending rows below " + std::to_string(count));
}

}  // namespace
}  // namespace ecorche::c

using namespace ecorche;

ecorche_code ecorche_body_create(const ecorche_model* model, const ecorche_body_options* options,
                                 ecorche_body** out) {
  if (model == nullptr || out == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "model, out: is null");
  return c::guarded([&] {
    const ecorche_body_options chosen = c::read(options, ecorche_body_options ECORCHE_BODY_OPTIONS_INIT);
    constexpr std::uint32_t most_threads = 1024;
    if (chosen.threads > most_threads)
      return c::fail(ECORCHE_INVALID_ARGUMENT, "threads: is more than 1024 (0 for one a processor)");
    auto body = std::make_unique<ecorche_body>();
    body->open = model->open;
    if (chosen.threads > 0) body->arena.emplace(static_cast<int>(chosen.threads));
    body->posed = model->open->poser.make_frame({.positions = true, .normals = chosen.normals != 0});
    body->tissues.reserve(model->open->model->tissues.size());
    const Pose rest = Pose::rest(model->open->skeleton().segments.size());
    Status status;
    body->run([&] {
      status =
          model->open->poser.run(rest, runtime::Skinning::cor, model->open->poser.all_tissues(), body->posed);
    });
    if (!status.ok()) return c::fail(status);
    const auto all = model->open->poser.all_tissues();
    body->tissues.assign(all.begin(), all.end());
    *out = body.release();
    return ECORCHE_OK;
  });
}

void ecorche_body_destroy(ecorche_body* body) {
  delete body;
}

ecorche_code ecorche_body_update(ecorche_body* body, const ecorche_pose* pose, ecorche_skinning skinning,
                                 const uint32_t* tissues, size_t tissue_count) {
  if (body == nullptr || pose == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "body, pose: is null");
  if (pose->open != body->open)
    return c::fail(ECORCHE_INVALID_ARGUMENT,
                   "pose: is of another model than the body (create both from one)");
  if (skinning < ECORCHE_SKINNING_LBS || skinning > ECORCHE_SKINNING_COR)
    return c::fail(ECORCHE_INVALID_ARGUMENT, "skinning: there is no such method (see ecorche_skinning)");
  return c::guarded([&] {
    const runtime::BodyPoser& poser = body->open->poser;
    const std::size_t count = poser.all_tissues().size();
    const std::span<const std::uint32_t> asked =
        tissues == nullptr ? poser.all_tissues() : std::span<const std::uint32_t>(tissues, tissue_count);
    for (std::size_t i = 0; i < asked.size(); ++i) {
      if (asked[i] >= count || (i > 0 && asked[i] <= asked[i - 1])) return c::bad_tissues(count);
    }
    Status status;
    body->run([&] {
      status = poser.run(pose->edited.pose(), static_cast<runtime::Skinning>(skinning), asked, body->posed);
    });
    if (!status.ok()) return c::fail(status);
    body->tissues.assign(asked.begin(), asked.end());
    body->reasons.clear();
    body->tree_follows = false;
    return ECORCHE_OK;
  });
}

const float* ecorche_body_positions(const ecorche_body* body, uint32_t tissue) {
  return body == nullptr || !c::holds(*body, tissue) ? nullptr : body->posed.tissues[tissue].data();
}

const int16_t* ecorche_body_normals(const ecorche_body* body, uint32_t tissue) {
  if (body == nullptr || !c::holds(*body, tissue) || body->posed.normals.empty()) return nullptr;
  const std::vector<std::int16_t>& normals = body->posed.normals[tissue];
  return normals.empty() ? nullptr : normals.data();
}

ecorche_code ecorche_body_copy(const ecorche_body* body, uint32_t tissue, ecorche_space space,
                               float* positions, size_t position_stride, float* normals, size_t normal_stride,
                               size_t capacity) {
  if (body == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "body: is null");
  return c::guarded([&] {
    if (!c::holds(*body, tissue))
      return c::fail(ECORCHE_FAILED_PRECONDITION, "tissue: the last update did not pose it (name it there)");
    const std::vector<float>& posed = body->posed.tissues[tissue];
    static const std::vector<std::int16_t> none;
    const auto& all = body->posed.normals;
    const std::vector<std::int16_t>& turned = all.empty() ? none : all[tissue];
    if (normals != nullptr && turned.empty() && !posed.empty())
      return c::fail(ECORCHE_FAILED_PRECONDITION, "normals: the body has none (see ecorche_body_options)");
    const auto points = [&](std::size_t first, std::size_t, c::Batch&) { return &posed[3 * first]; };
    const auto directions = [&](std::size_t first, std::size_t count, c::Batch& batch) {
      std::copy_n(&turned[3 * first], 3 * count, batch.begin());
      return batch.data();
    };
    return c::copy_vertices(posed.size() / 3, points, directions, 1.0 / 32767, space,
                            {positions, position_stride, normals, normal_stride, capacity});
  });
}

ecorche_code ecorche_body_motion(const ecorche_body* body, uint32_t segment, double matrix[12]) {
  if (body == nullptr || matrix == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "body, matrix: is null");
  return c::guarded([&] {
    const auto& all = body->posed.segments;
    if (segment >= all.size())
      return c::fail(ECORCHE_INVALID_ARGUMENT,
                     "segment: the model has " + std::to_string(all.size()) + " of them");
    const Eigen::Matrix3d turn = all[segment].q.toRotationMatrix();
    for (int r = 0; r < 3; ++r) {
      for (int k = 0; k < 3; ++k) matrix[4 * r + k] = turn(r, k);
      matrix[4 * r + 3] = all[segment].t[r];
    }
    return ECORCHE_OK;
  });
}

uint32_t ecorche_body_clamped_count(const ecorche_body* body) {
  return body == nullptr ? 0 : static_cast<uint32_t>(body->posed.clamped.size());
}

ecorche_code ecorche_body_clamped(const ecorche_body* body, uint32_t row, uint32_t* segment,
                                  double* removed) {
  if (body == nullptr || segment == nullptr || removed == nullptr)
    return c::fail(ECORCHE_INVALID_ARGUMENT, "body, segment, removed: is null");
  if (row >= body->posed.clamped.size())
    return c::fail(ECORCHE_INVALID_ARGUMENT, "row: is not below ecorche_body_clamped_count");
  *segment = static_cast<uint32_t>(body->posed.clamped[row].joint);
  *removed = body->posed.clamped[row].removed;
  return ECORCHE_OK;
}
