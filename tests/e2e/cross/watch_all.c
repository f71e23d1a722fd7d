/* SPDX-License-Identifier: Apache-2.0 */
/* watch_all HOST:PORT OUT ENCODING JOINT ANGLE [TOKEN [AUTHORITIES.pem]]: writes what a system makes of a served body: three
 * poses of a session of its own, of each all tissues' positions and normals as they came and in Unity's space. */
#include <ecorche/ecorche_client.h>
#include <stdio.h>
#include <stdlib.h>

static void check(ecorche_code code) {
  if (code == ECORCHE_OK) return;
  fprintf(stderr, "error: %s\n", ecorche_client_error_message());
  exit(1);
}

static void write_frame(ecorche_client* client, FILE* out) {
  for (uint32_t row = 0; row < ecorche_client_tissue_count(client); ++row) {
    ecorche_tissue_info tissue = ECORCHE_TISSUE_INFO_INIT;
    check(ecorche_client_tissue(client, row, &tissue));
    const size_t numbers = 3 * (size_t)tissue.vertex_count;
    float* const vertices = malloc(2 * numbers * sizeof(float));
    if (vertices == NULL) exit(71);
    check(ecorche_client_copy(client, row, ECORCHE_SPACE_UNITY, vertices, 24, vertices + 3, 24, tissue.vertex_count));
    fwrite(ecorche_client_positions(client, row), sizeof(float), numbers, out);
    fwrite(ecorche_client_normals(client, row), sizeof(float), numbers, out);
    fwrite(vertices, sizeof(float), 2 * numbers, out);
    free(vertices);
  }
}

int main(int argc, char** argv) {
  if (argc < 6) return 64;
  ecorche_client* client = NULL;
  ecorche_client_options options = ECORCHE_CLIENT_OPTIONS_INIT;
  if (argc > 6) options.token = argv[6];
  if (argc > 7) options.authorities = argv[7];
  check(ecorche_client_connect(argv[1], &options, &client));
  check(ecorche_client_open(client, NULL, NULL));
  ecorche_stream_options stream = ECORCHE_STREAM_OPTIONS_INIT;
  stream.encoding = (ecorche_encoding)atoi(argv[3]);
  check(ecorche_client_subscribe(client, &stream));
  FILE* out = fopen(argv[2], "wb");
  if (out == NULL) return 73;
  for (int i = 0; i < 3; ++i) {
    uint64_t sent = 0;
    check(ecorche_client_set_angle(client, argv[4], argv[5], 0.3 * i + 0.2));
    check(ecorche_client_send_pose(client, ECORCHE_SKINNING_COR, &sent));
    ecorche_event event = ECORCHE_EVENT_INIT;
    do {
      check(ecorche_client_poll(client, 60, &event));
      check(event.code);
      if (event.kind == ECORCHE_EVENT_NONE) return 75;
    } while (event.kind != ECORCHE_EVENT_FRAME || event.sequence < sent);
    write_frame(client, out);
  }
  printf("%s: %u tissues\n", ecorche_client_server(client), (unsigned)ecorche_client_tissue_count(client));
  ecorche_client_close(client);
  return fclose(out) == 0 ? 0 : 74;
}
