/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shows bodies that an ecorche server poses, from any language that calls C: what libecorche does in process,
 * with the work done elsewhere and others looking on.
 *
 *   ecorche_client* client = NULL;
 *   if (ecorche_client_connect("127.0.0.1:7070", NULL, &client) != ECORCHE_OK) {
 *     fprintf(stderr, "%s\n", ecorche_client_error_message());
 *     exit(1);
 *   }
 *   ecorche_client_open(client, NULL, NULL);
 *   ecorche_client_subscribe(client, NULL);
 *   ecorche_client_set_angle(client, "elbow_left", "flexion", 1.57);
 *   ecorche_client_send_pose(client, ECORCHE_SKINNING_COR, NULL);
 *   ecorche_event event = ECORCHE_EVENT_INIT;
 *   while (ecorche_client_poll(client, 0, &event) == ECORCHE_OK && event.kind != ECORCHE_EVENT_NONE) {
 *     if (event.kind == ECORCHE_EVENT_FRAME) draw(ecorche_client_positions(client, 0));
 *   }
 *
 * Units, errors, ownership and structs are as in ecorche.h, but for the error message, which is
 * ecorche_client_error_message(). Text is UTF-8; INVALID_ARGUMENT where it is not.
 *
 * Threads: a client is for one thread at a time. It starts none: it reads and answers the server within
 * ecorche_client_poll and within what waits for an answer, so call the former for every picture until nothing
 * more comes: who takes one thing a picture falls ever farther behind. Of frames that come while an answer is
 * waited for the newest stays.
 *
 * After UNAVAILABLE the connection is gone: ecorche_client_resume() comes back.
 */
#ifndef ECORCHE_CLIENT_H
#define ECORCHE_CLIENT_H

#include <ecorche/ecorche.h>

#ifdef __cplusplus
extern "C" {
#endif

/* As ecorche_abi_version, ecorche_version and ecorche_error_message, of this library. */
ECORCHE_API unsigned ecorche_client_abi_version(void);
ECORCHE_API const char* ecorche_client_version(void);
ECORCHE_API const char* ecorche_client_error_message(void);

/* ---- connections ---- */

typedef struct ecorche_client ecorche_client;

typedef struct ecorche_client_options {
  size_t struct_size;
  const char* name;        /* that the server's log has; NULL: "ecorche_client" */
  const char* token;       /* of the right to connect; NULL: none */
  const char* authorities; /* PEM file of certificates that are trusted; NULL: no TLS */
  const char* session;     /* to be opened: a balancer of several servers goes by it; NULL: one's own */
} ecorche_client_options;
#define ECORCHE_CLIENT_OPTIONS_INIT \
  { sizeof(ecorche_client_options), 0, 0, 0, 0 }

/* "127.0.0.1:7070". Waits 5 s at most for the connection, and 5 s for the server to
 * greet; `options` may be NULL. UNAVAILABLE where nobody answers there. */
ECORCHE_API ecorche_code ecorche_client_connect(const char* address, const ecorche_client_options* options,
                                                ecorche_client** out);
/* Says goodbye, so that its control is free at once, and nobody comes back to its place. Waits for the server
 * to hear it, half a second at most. */
ECORCHE_API void ecorche_client_close(ecorche_client* client);
/* Which ecorche answers: "0.1.0". */
ECORCHE_API const char* ecorche_client_server(const ecorche_client* client);
/* Received so far. */
ECORCHE_API uint64_t ecorche_client_bytes(const ecorche_client* client);

/* The models that the server has; their names are good until the next call. */
ECORCHE_API ecorche_code ecorche_client_models(ecorche_client* client, uint32_t* count);
ECORCHE_API const char* ecorche_client_model(const ecorche_client* client, uint32_t row);

/* Opens a model (NULL: the first) in a session that others may join by its name (NULL: one of its own). Once
 * for a connection. NOT_FOUND for another model. */
ECORCHE_API ecorche_code ecorche_client_open(ecorche_client* client, const char* model, const char* session);
/* Its name, for others. */
ECORCHE_API const char* ecorche_client_session(const ecorche_client* client);

/* What was opened; see the functions of ecorche_model that are named alike. `rest` of a tissue is NULL: it
 * comes by frames. */
ECORCHE_API uint32_t ecorche_client_tissue_count(const ecorche_client* client);
ECORCHE_API ecorche_code ecorche_client_tissue(const ecorche_client* client, uint32_t tissue,
                                               ecorche_tissue_info* out);
ECORCHE_API uint32_t ecorche_client_segment_count(const ecorche_client* client);
ECORCHE_API ecorche_code ecorche_client_segment(const ecorche_client* client, uint32_t segment,
                                                ecorche_segment_info* out);
ECORCHE_API uint32_t ecorche_client_angle_count(const ecorche_client* client);
ECORCHE_API ecorche_code ecorche_client_angle(const ecorche_client* client, uint32_t angle,
                                              ecorche_angle_info* out);

/* ---- poses ---- */

/* Not 0: this client poses the session, and others look on. */
ECORCHE_API int ecorche_client_controls(const ecorche_client* client);
/* Takes control where it is free; FAILED_PRECONDITION where another has it. */
ECORCHE_API ecorche_code ecorche_client_claim(ecorche_client* client);
ECORCHE_API ecorche_code ecorche_client_release(ecorche_client* client);

/* The pose that is sent next; see the functions of ecorche_pose that are named alike. */
ECORCHE_API ecorche_code ecorche_client_reset_pose(ecorche_client* client);
ECORCHE_API ecorche_code ecorche_client_set_angle(ecorche_client* client, const char* joint,
                                                  const char* angle, double radians);
ECORCHE_API ecorche_code ecorche_client_set_angle_at(ecorche_client* client, uint32_t angle, double radians);
ECORCHE_API ecorche_code ecorche_client_set_rotation(ecorche_client* client, uint32_t segment,
                                                     const double xyzw[4]);
ECORCHE_API ecorche_code ecorche_client_set_root(ecorche_client* client, const double translation[3]);
/* Sends it, and does not wait. `sequence` (may be NULL) is what the frame that shows it will say. */
ECORCHE_API ecorche_code ecorche_client_send_pose(ecorche_client* client, ecorche_skinning skinning,
                                                  uint64_t* sequence);

/* ---- frames ---- */

typedef enum ecorche_encoding {
  ECORCHE_ENCODING_F32 = 1,      /* 12 bytes a vertex; bit for bit what libecorche gives */
  ECORCHE_ENCODING_U16 = 2,      /* 6 bytes, within half a step: some 0.03 mm */
  ECORCHE_ENCODING_U16_DELTA = 3 /* the same numbers in a third of that while the body moves */
} ecorche_encoding;

typedef struct ecorche_stream_options {
  size_t struct_size;
  ecorche_encoding encoding;
  int32_t normals;         /* not 0: with normals, within 1 degree */
  double max_rate;         /* frames a second; 0: every pose */
  const uint32_t* tissues; /* rows; NULL: all */
  size_t tissue_count;
  int32_t quality; /* not 0: a pose is measured before its frame leaves, in a whole body's time */
} ecorche_stream_options;
#define ECORCHE_STREAM_OPTIONS_INIT \
  { sizeof(ecorche_stream_options), ECORCHE_ENCODING_U16_DELTA, 1, 0, 0, 0, 0 }

/* Frames come from now on; `options` may be NULL. Another call replaces the last one, but where it is refused
 * (INVALID_ARGUMENT for a rate that is none, or no tissues at all): then frames go on as before. */
ECORCHE_API ecorche_code ecorche_client_subscribe(ecorche_client* client,
                                                  const ecorche_stream_options* options);

typedef enum ecorche_event_kind {
  ECORCHE_EVENT_NONE = 0,  /* nothing more came */
  ECORCHE_EVENT_FRAME = 1, /* positions are new */
  ECORCHE_EVENT_POSE = 2, /* a pose was taken (`code` is OK), or refused for ecorche_client_error_message() */
  ECORCHE_EVENT_CONTROL = 3,       /* ecorche_client_controls() changed, or control is free */
  ECORCHE_EVENT_MODEL_CHANGED = 4, /* the server has read the model anew: connect again */
  ECORCHE_EVENT_VOLUME = 5 /* voxels of `stream` are new; or, where `code` is not OK, none could be made, and
                              those before stay */
} ecorche_event_kind;

typedef struct ecorche_event {
  size_t struct_size;
  ecorche_event_kind kind;
  ecorche_code code;
  uint64_t sequence; /* of FRAME, VOLUME and POSE: which pose */
  int32_t vacant;    /* of CONTROL: not 0: ecorche_client_claim would have it */
  uint32_t stream;   /* of VOLUME: which of ecorche_client_subscribe_volume */
} ecorche_event;
#define ECORCHE_EVENT_INIT \
  { sizeof(ecorche_event), ECORCHE_EVENT_NONE, ECORCHE_OK, 0, 0, 0 }

/* The next thing that came. Waits `seconds` for one; 0: never, for a game's loop. */
ECORCHE_API ecorche_code ecorche_client_poll(ecorche_client* client, double seconds, ecorche_event* out);

/* The connection's socket, for a loop of events that waits for many: when it can be read, call
 * ecorche_client_poll with 0 until nothing more comes; call it so, too, after every function that waits for
 * an answer, since what came with the answer waits in the client. Another one after ecorche_client_resume.
 * Not to be read, written or closed. -1 for none. */
ECORCHE_API intptr_t ecorche_client_descriptor(const ecorche_client* client);

/* Of the last frame: 3 * vertex_count, LPS mm; NULL before the first, or for a tissue that was not asked for.
 * Pointers into a frame are good until the next poll. Floats are made at the first of these calls, so who
 * only copies, or draws by numbers, does not wait for them. */
ECORCHE_API const float* ecorche_client_positions(const ecorche_client* client, uint32_t tissue);
/* 3 * vertex_count, unit vectors; NULL where there are none. */
ECORCHE_API const float* ecorche_client_normals(const ecorche_client* client, uint32_t tissue);
/* As ecorche_body_copy. Faster than to turn what the two above return. */
ECORCHE_API ecorche_code ecorche_client_copy(const ecorche_client* client, uint32_t tissue,
                                             ecorche_space space, float* positions, size_t position_stride,
                                             float* normals, size_t normal_stride, size_t capacity);
/* A tissue of the last frame as it came, for a vertex shader to make floats of (clients/shaders). */
typedef struct ecorche_packed {
  size_t struct_size;
  uint32_t vertex_count;
  const uint16_t* positions; /* 3 * vertex_count; LPS mm: low + step * number */
  const int8_t* normals;     /* 2 * vertex_count, octahedral, in 127ths; NULL where there are none */
  double low[3], step;       /* mm; they may change from frame to frame */
} ecorche_packed;
#define ECORCHE_PACKED_INIT \
  { sizeof(ecorche_packed), 0, 0, 0, {0, 0, 0}, 0 }

/* FAILED_PRECONDITION where no frame has brought the tissue, or frames of ECORCHE_ENCODING_F32. */
ECORCHE_API ecorche_code ecorche_client_packed(const ecorche_client* client, uint32_t tissue,
                                               ecorche_packed* out);
/* The same numbers into the caller's vertices of 8 bytes, a mapped buffer of the graphics card for one: three
 * uint16, and a uint16 "oct16" as clients/shaders have it (u + 128 in the low byte, v + 128 in the high one;
 * 0: no normal). Room for `capacity` vertices; INVALID_ARGUMENT where that is too little. Allocates nothing.
 */
ECORCHE_API ecorche_code ecorche_client_copy_packed(const ecorche_client* client, uint32_t tissue,
                                                    void* vertices, size_t capacity);
/* The last quality that frames told, and of which pose it is (`sequence` may be NULL). FAILED_PRECONDITION
 * where none has yet. A server measures as ecorche_body_measure does when it samples, and tells no reasons:
 * reason_count is 0. */
ECORCHE_API ecorche_code ecorche_client_quality(const ecorche_client* client, ecorche_quality* out,
                                                uint64_t* sequence);

/* ---- volumes ---- */

/* Images that follow the body; see ecorche_model_volume. `rest` is NULL: voxels come by frames. */
ECORCHE_API uint32_t ecorche_client_volume_count(const ecorche_client* client);
ECORCHE_API ecorche_code ecorche_client_volume(const ecorche_client* client, uint32_t volume,
                                               ecorche_volume_info* out);

typedef enum ecorche_deformer {
  ECORCHE_DEFORMER_TETS = 1,   /* as ecorche_body_volume */
  ECORCHE_DEFORMER_SPHERES = 2 /* as ecorche_body_refill, by the spheres that the model holds */
} ecorche_deformer;

typedef struct ecorche_volume_options {
  size_t struct_size;
  ecorche_deformer deformer;
  int32_t nearest;      /* not 0: no interpolation */
  const double* region; /* 6: the low and the high corner of a box in the posed body, both ends included, LPS
                           mm; NULL: all */
  const ecorche_grid* slices; /* instead: so many planes, each one voxel thick along k, wherever it lies */
  size_t slice_count;         /* at most 16 */
  int32_t compressed;         /* not 0: fewer bytes on the way, more work at both ends */
  double max_rate;            /* frames a second; 0: every pose */
} ecorche_volume_options;
#define ECORCHE_VOLUME_OPTIONS_INIT \
  { sizeof(ecorche_volume_options), ECORCHE_DEFORMER_TETS, 0, 0, 0, 0, 0, 0 }

/* Frames of the posed volume come from now on as well, also after coming back, each an ECORCHE_EVENT_VOLUME
 * of this `stream`; who asks for the same again has the same stream. On the way are only the parts that
 * changed. `options` may be NULL. FAILED_PRECONDITION for spheres that the model lacks, INVALID_ARGUMENT for
 * a region beside slices, or one that holds no voxel. */
ECORCHE_API ecorche_code ecorche_client_subscribe_volume(ecorche_client* client, uint32_t volume,
                                                         const ecorche_volume_options* options,
                                                         uint32_t* stream);
/* No more of them. What is not a stream is NOT_FOUND. */
ECORCHE_API ecorche_code ecorche_client_unsubscribe_volume(ecorche_client* client, uint32_t stream);

/* The voxels of a volume, or of a slice, and where they lie: a volume on the scan's own lattice, grown until
 * it holds the posed body, or the region of it. */
typedef struct ecorche_voxels {
  size_t struct_size;
  uint64_t sequence; /* of the pose that they show */
  ecorche_grid grid;
  ecorche_scalar type;
  int32_t components; /* of a voxel, side by side */
  const void* voxels; /* i fastest */
  size_t bytes;
} ecorche_voxels;
#define ECORCHE_VOXELS_INIT                                                                                \
  {                                                                                                        \
    sizeof(ecorche_voxels), 0, {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 0}}, ECORCHE_U8, \
        0, 0, 0                                                                                            \
  }

/* What the stream's last frame brought; good until the next poll. `slice`: which of those that were asked
 * for; 0 without slices. FAILED_PRECONDITION where none has come. Allocates nothing. */
ECORCHE_API ecorche_code ecorche_client_voxels(const ecorche_client* client, uint32_t stream, uint32_t slice,
                                               ecorche_voxels* out);

/* ---- coming back, clips, recordings ---- */

/* After the connection was lost: connects again, where its server said so to another one, and has the
 * session, its control, its frames and volumes as before, where the server kept the place (a minute), else as
 * anybody who opens the session by its name. Frames that were read stay good. Waits 5 s at most; UNAVAILABLE
 * where nobody answers yet: call again after a while; a client that was sent to another server tries the two
 * in turn. FAILED_PRECONDITION where the model is another one by now: close the client, and connect anew. */
ECORCHE_API ecorche_code ecorche_client_resume(ecorche_client* client);

/* Motion that the server holds; names are good until the next call. */
ECORCHE_API ecorche_code ecorche_client_clips(ecorche_client* client, uint32_t* count);
/* `seconds`: how long it takes; may be NULL. */
ECORCHE_API const char* ecorche_client_clip(const ecorche_client* client, uint32_t row, double* seconds);
/* The server poses by itself, until the clip ends, a pose is sent, or `clip` is NULL. `speed`: 0.01 to 100.
 * PERMISSION_DENIED where another has control. */
ECORCHE_API ecorche_code ecorche_client_play(ecorche_client* client, const char* clip, double speed,
                                             int loop);
/* The server records the session's poses and frames under this name ([a-z0-9_], at most 64), which becomes a
 * clip; NULL: ends, and returns once the file is whole. FAILED_PRECONDITION where it keeps no recordings. */
ECORCHE_API ecorche_code ecorche_client_record(ecorche_client* client, const char* name);

/* ---- probes ---- */

/* As ecorche_body_posed_to_rest and _rest_to_posed, of the body as the server last showed it; waits for the
 * answer. Of ecorche_probed only points and tissues; at most 10000 points. */
ECORCHE_API ecorche_code ecorche_client_posed_to_rest(ecorche_client* client, const float* points,
                                                      size_t count, ecorche_probed* out);
ECORCHE_API ecorche_code ecorche_client_rest_to_posed(ecorche_client* client, const float* points,
                                                      size_t count, ecorche_probed* out);

#ifdef __cplusplus
}
#endif

#endif
