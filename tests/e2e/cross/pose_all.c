/* SPDX-License-Identifier: Apache-2.0 */
/* pose_all MODEL.hdf OUT JOINT ANGLE: writes what a processor makes of a body: the joint bent by 75 degrees, by each
 * skinning, all tissues' positions (float) and normals (int16), tissue by tissue. */
#include <ecorche/ecorche.h>
#include <stdio.h>
#include <stdlib.h>

static void check(ecorche_code code) {
  if (code == ECORCHE_OK) return;
  fprintf(stderr, "error: %s\n", ecorche_error_message());
  exit(1);
}

int main(int argc, char** argv) {
  if (argc != 5) return 64;
  ecorche_model* model = NULL;
  ecorche_pose* pose = NULL;
  ecorche_body* body = NULL;
  ecorche_body_options options = ECORCHE_BODY_OPTIONS_INIT;
  options.normals = 1;
  check(ecorche_model_open(argv[1], &model));
  check(ecorche_pose_create(model, &pose));
  check(ecorche_body_create(model, &options, &body));
  check(ecorche_pose_set_angle(pose, argv[3], argv[4], 75 / 57.29577951308232));
  FILE* out = fopen(argv[2], "wb");
  if (out == NULL) return 73;
  for (int skinning = ECORCHE_SKINNING_LBS; skinning <= ECORCHE_SKINNING_COR; ++skinning) {
    check(ecorche_body_update(body, pose, (ecorche_skinning)skinning, NULL, 0));
    for (uint32_t row = 0; row < ecorche_model_tissue_count(model); ++row) {
      ecorche_tissue_info tissue = ECORCHE_TISSUE_INFO_INIT;
      check(ecorche_model_tissue(model, row, &tissue));
      const size_t numbers = 3 * (size_t)tissue.vertex_count;
      fwrite(ecorche_body_positions(body, row), sizeof(float), numbers, out);
      fwrite(ecorche_body_normals(body, row), sizeof(int16_t), numbers, out);
      printf("%d %s %u\n", skinning, tissue.name, (unsigned)tissue.vertex_count);
    }
  }
  ecorche_body_destroy(body);
  ecorche_pose_destroy(pose);
  ecorche_model_close(model);
  return fclose(out) == 0 ? 0 : 74;
}
