/* SPDX-License-Identifier: Apache-2.0 */
/* pose_c MODEL.hdf JOINT ANGLE DEGREES: how far the farthest vertex of the skin moves, and the verdict. */
#include <ecorche/ecorche.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void check(ecorche_code code) {
  if (code == ECORCHE_OK) return;
  fprintf(stderr, "error: %s\n", ecorche_error_message());
  exit(1);
}

int main(int argc, char** argv) {
  if (argc != 5 || ecorche_abi_version() != ECORCHE_ABI_VERSION) return 64;

  ecorche_model* model = NULL;
  ecorche_pose* pose = NULL;
  ecorche_body* body = NULL;
  check(ecorche_model_open(argv[1], &model));
  check(ecorche_pose_create(model, &pose));
  check(ecorche_body_create(model, NULL, &body));

  check(ecorche_pose_set_angle(pose, argv[2], argv[3], atof(argv[4]) / 57.29577951308232));
  check(ecorche_body_update(body, pose, ECORCHE_SKINNING_COR, NULL, 0));

  ecorche_tissue_info skin = ECORCHE_TISSUE_INFO_INIT;
  check(ecorche_model_tissue(model, 0, &skin));
  const float* posed = ecorche_body_positions(body, 0);
  double farthest = 0;
  for (uint32_t v = 0; v < 3 * skin.vertex_count; v += 3) {
    const double x = posed[v] - skin.rest[v], y = posed[v + 1] - skin.rest[v + 1], z = posed[v + 2] - skin.rest[v + 2];
    farthest = fmax(farthest, sqrt(x * x + y * y + z * z));
  }
  ecorche_quality quality = ECORCHE_QUALITY_INIT;
  check(ecorche_body_measure(body, 0, &quality));
  printf("ecorche %s: %.1f mm, %s\n", ecorche_version(), farthest, quality.pass ? "pass" : "warn");

  ecorche_body_destroy(body);
  ecorche_pose_destroy(pose);
  ecorche_model_close(model);
  return 0;
}
