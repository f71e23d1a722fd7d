/* SPDX-License-Identifier: Apache-2.0 */
/* watch_c HOST:PORT JOINT ANGLE DEGREES: bends a joint of a served body, and prints how wide the skin is in
 * the frame that comes back. */
#include <ecorche/ecorche_client.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void check(ecorche_code code) {
  if (code == ECORCHE_OK) return;
  fprintf(stderr, "error: %s\n", ecorche_client_error_message());
  exit(1);
}

int main(int argc, char** argv) {
  if (argc != 5 || ecorche_client_abi_version() != ECORCHE_ABI_VERSION) return 64;

  ecorche_client* client = NULL;
  check(ecorche_client_connect(argv[1], NULL, &client));
  check(ecorche_client_open(client, NULL, NULL));
  check(ecorche_client_subscribe(client, NULL));

  uint64_t sent = 0;
  check(ecorche_client_set_angle(client, argv[2], argv[3], atof(argv[4]) / 57.29577951308232));
  check(ecorche_client_send_pose(client, ECORCHE_SKINNING_COR, &sent));

  /* A game polls with 0 s, for each picture until nothing more comes; here there is nothing else to do. */
  ecorche_event event = ECORCHE_EVENT_INIT;
  do {
    check(ecorche_client_poll(client, 10, &event));
    check(event.code); /* the server refused the pose */
  } while (event.kind != ECORCHE_EVENT_NONE && (event.kind != ECORCHE_EVENT_FRAME || event.sequence < sent));

  ecorche_tissue_info skin = ECORCHE_TISSUE_INFO_INIT;
  check(ecorche_client_tissue(client, 0, &skin));
  const float* posed = ecorche_client_positions(client, 0);
  if (posed == NULL) return 1;
  float least = posed[0], most = posed[0];
  for (uint32_t v = 0; v < 3 * skin.vertex_count; v += 3) {
    least = fminf(least, posed[v]);
    most = fmaxf(most, posed[v]);
  }
  printf("%s of session %s is %.0f mm wide\n", skin.name, ecorche_client_session(client), most - least);

  ecorche_client_close(client);
  return 0;
}
