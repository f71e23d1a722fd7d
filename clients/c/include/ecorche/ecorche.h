/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Poses prepared bodies in your own process, from any language that calls C.
 *
 *   ecorche_model* model = NULL;
 *   ecorche_pose* pose = NULL;
 *   ecorche_body* body = NULL;
 *   if (ecorche_model_open("patient.hdf", &model) != ECORCHE_OK) {
 *     fprintf(stderr, "%s\n", ecorche_error_message());
 *     exit(1);
 *   }
 *   ecorche_pose_create(model, &pose);
 *   ecorche_body_create(model, NULL, &body);
 *   ecorche_pose_set_angle(pose, "elbow_left", "flexion", 1.57);
 *   ecorche_body_update(body, pose, ECORCHE_SKINNING_COR, NULL, 0);
 *   const float* skin = ecorche_body_positions(body, 0);
 *
 * Units: millimetres and radians, in the patient's LPS axes: x to the left, y to the back, z up.
 * ecorche_space says what turns them into an engine's own.
 *
 * Errors: a function that can fail returns an ecorche_code; what went wrong, where and how to mend it says
 * ecorche_error_message(). No C++ exception leaves the library. A null handle is ECORCHE_INVALID_ARGUMENT, or
 * where a number or a pointer is returned 0 or NULL.
 *
 * Ownership: who creates or opens a handle closes it; closing NULL does nothing. A pose and a body keep their
 * model alive. Buffers are the caller's, and never kept. Pointers that are returned are the library's: into
 * the model as long as it is open, into a body until its next update.
 *
 * Threads: a model may be used by any number of threads at once. A pose and a body are for one thread at a
 * time.
 *
 * Structs begin with `struct_size`: set it to sizeof, as the _INIT macros do. A later version may add members
 * at the end; it fills no more than there is room for.
 */
#ifndef ECORCHE_H
#define ECORCHE_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32) && defined(ECORCHE_BUILDING)
#define ECORCHE_API __declspec(dllexport)
#elif defined(_WIN32)
#define ECORCHE_API __declspec(dllimport)
#elif defined(ECORCHE_BUILDING) && defined(__GNUC__)
#define ECORCHE_API __attribute__((visibility("default")))
#else
#define ECORCHE_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- versions ---- */

/* Grows by one where a program that was built with an older header no longer works. */
#define ECORCHE_ABI_VERSION 0

/* The ABI of the library that was loaded: a program checks it against ECORCHE_ABI_VERSION. */
ECORCHE_API unsigned ecorche_abi_version(void);
/* "0.1.0". */
ECORCHE_API const char* ecorche_version(void);

/* ---- errors ---- */

/* Numbers of google.rpc.Code, as in the protocol. */
typedef enum ecorche_code {
  ECORCHE_OK = 0,
  ECORCHE_UNKNOWN = 2,
  ECORCHE_INVALID_ARGUMENT = 3,
  ECORCHE_DEADLINE_EXCEEDED = 4,
  ECORCHE_NOT_FOUND = 5,
  ECORCHE_PERMISSION_DENIED = 7,
  ECORCHE_RESOURCE_EXHAUSTED = 8,
  ECORCHE_FAILED_PRECONDITION = 9,
  ECORCHE_OUT_OF_RANGE = 11,
  ECORCHE_INTERNAL = 13,
  ECORCHE_UNAVAILABLE = 14,
  ECORCHE_DATA_LOSS = 15,
  ECORCHE_UNAUTHENTICATED = 16
} ecorche_code;

/* Of this thread's last call that failed: "WHERE: WHAT (HOW TO MEND)", UTF-8, one line; until its next one.
 * "" where none has failed yet. */
ECORCHE_API const char* ecorche_error_message(void);

/* ---- spaces ---- */

/* Where a program has its points. The patient faces the way that a character of that engine faces. */
typedef enum ecorche_space {
  ECORCHE_SPACE_LPS_MM = 0, /* ecorche's own: x left, y back, z up; right-handed, mm */
  ECORCHE_SPACE_UNITY = 1,  /* x right, y up, z forward; left-handed, m */
  ECORCHE_SPACE_UNREAL = 2, /* x forward, y right, z up; left-handed, cm */
  ECORCHE_SPACE_GLTF = 3, /* also OpenXR, WebXR and three.js: x left of who faces +z, y up; right-handed, m */
  ECORCHE_SPACE_ROS = 4,  /* REP 103: x forward, y left, z up; right-handed, m */
  ECORCHE_SPACE_RAS_MM = 5 /* OpenIGTLink, 3D Slicer: x right, y front, z up; right-handed, mm */
} ecorche_space;

/* From LPS mm: `matrix` is 3 by 3, row by row, and scales as well; 1 where it mirrors, for the space is
 * left-handed, else 0, and -1 for a space that does not exist.
 * Triangles are counter-clockwise as seen from outside in every space. That is the front in Unreal, glTF and
 * OpenGL. In Unity the front is clockwise: swap two corners of each triangle there. */
ECORCHE_API int ecorche_space_matrix(ecorche_space space, double matrix[9]);
/* `count` points of three floats, LPS mm, into the space, `stride` bytes from one to the next (0: 12); `out`
 * may be `in`, whatever the strides. */
ECORCHE_API ecorche_code ecorche_space_points(ecorche_space space, size_t count, const float* in,
                                              size_t in_stride, float* out, size_t out_stride);
/* A point of the space back into LPS mm: what a probe takes. */
ECORCHE_API ecorche_code ecorche_space_points_back(ecorche_space space, size_t count, const float* in,
                                                   size_t in_stride, float* out, size_t out_stride);
/* A rotation, as quaternion x, y, z, w, of LPS into the space, or with `back` of the space into LPS. */
ECORCHE_API ecorche_code ecorche_space_rotation(ecorche_space space, int back, const double in[4],
                                                double out[4]);

/* ---- models ---- */

/* A prepared body, as `ecorche preprocess` writes it. Never changes. */
typedef struct ecorche_model ecorche_model;

/* Reads and checks a model.hdf, and makes it ready to be posed: a moment (a second for three million tets).
 * NOT_FOUND, or INVALID_ARGUMENT for a file that is no model or a damaged one. */
ECORCHE_API ecorche_code ecorche_model_open(const char* path, ecorche_model** out);
ECORCHE_API void ecorche_model_close(ecorche_model* model);
ECORCHE_API const char* ecorche_model_name(const ecorche_model* model);
/* Equal for two models that pose alike. */
ECORCHE_API uint64_t ecorche_model_identity(const ecorche_model* model);

/* A surface: skin, bone, organ. */
typedef struct ecorche_tissue_info {
  size_t struct_size;
  const char* name;
  const char* group; /* skin, bone, muscle, organ, vessel, nerve, cartilage, ligament, fat or other */
  uint32_t vertex_count;
  uint32_t triangle_count;
  const uint32_t* triangles; /* 3 * triangle_count rows of vertices, counter-clockwise seen from outside */
  const float* rest;         /* 3 * vertex_count, as scanned, LPS mm */
  int32_t segment;           /* that a bone moves with; -1: it bends */
} ecorche_tissue_info;
#define ECORCHE_TISSUE_INFO_INIT \
  { sizeof(ecorche_tissue_info), 0, 0, 0, 0, 0, 0, -1 }

/* The skin is tissue 0. */
ECORCHE_API uint32_t ecorche_model_tissue_count(const ecorche_model* model);
ECORCHE_API ecorche_code ecorche_model_tissue(const ecorche_model* model, uint32_t tissue,
                                              ecorche_tissue_info* out);
/* The row of a name; -1 where there is none. */
ECORCHE_API int32_t ecorche_model_find_tissue(const ecorche_model* model, const char* name);

/* A part of the skeleton, and the joint about which it turns. */
typedef struct ecorche_segment_info {
  size_t struct_size;
  const char* name;
  const char* joint;
  int32_t parent;    /* a lower row; -1: the root */
  double centre[3];  /* of the joint as scanned, LPS mm */
  double axes[9];    /* of its frame as scanned: its x, y and z axis one after the other, LPS */
  double confidence; /* 0 to 1: how well the joint was found */
} ecorche_segment_info;
#define ECORCHE_SEGMENT_INFO_INIT \
  { sizeof(ecorche_segment_info), 0, 0, -1, {0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 0}, 0 }

ECORCHE_API uint32_t ecorche_model_segment_count(const ecorche_model* model);
ECORCHE_API ecorche_code ecorche_model_segment(const ecorche_model* model, uint32_t segment,
                                               ecorche_segment_info* out);
/* The row of a segment's or a joint's name; -1 where there is none. */
ECORCHE_API int32_t ecorche_model_find_segment(const ecorche_model* model, const char* name);

/* An anatomical angle of a joint: the flexion of an elbow. */
typedef struct ecorche_angle_info {
  size_t struct_size;
  const char* joint;
  const char* name;
  uint32_t segment;
  double rest;     /* as scanned, radians */
  double min, max; /* radians; infinite where there is no limit */
} ecorche_angle_info;
#define ECORCHE_ANGLE_INFO_INIT \
  { sizeof(ecorche_angle_info), 0, 0, 0, 0, 0, 0 }

ECORCHE_API uint32_t ecorche_model_angle_count(const ecorche_model* model);
ECORCHE_API ecorche_code ecorche_model_angle(const ecorche_model* model, uint32_t angle,
                                             ecorche_angle_info* out);

/* ---- poses ---- */

/* How every joint is turned. What limits and couplings make of it decides ecorche_body_update. */
typedef struct ecorche_pose ecorche_pose;

/* As scanned. */
ECORCHE_API ecorche_code ecorche_pose_create(const ecorche_model* model, ecorche_pose** out);
ECORCHE_API void ecorche_pose_destroy(ecorche_pose* pose);
/* As scanned again. */
ECORCHE_API ecorche_code ecorche_pose_reset(ecorche_pose* pose);
/* "lib:sitting" (anatomical, arms_up, lateral, lithotomy, prone, sitting, squatting, supine) or a pose file. All that it
 * does not name is as scanned; of the library's what the model has not is left out. */
ECORCHE_API ecorche_code ecorche_pose_load(ecorche_pose* pose, const char* name);
/* One anatomical angle, absolute, by names: "elbow_left", "flexion", or what the joint calls the opposite.
 * The other angles of the joint stay. NOT_FOUND for another name. */
ECORCHE_API ecorche_code ecorche_pose_set_angle(ecorche_pose* pose, const char* joint, const char* angle,
                                                double radians);
/* The same by the row of ecorche_model_angle. */
ECORCHE_API ecorche_code ecorche_pose_set_angle_at(ecorche_pose* pose, uint32_t angle, double radians);
ECORCHE_API ecorche_code ecorche_pose_angle(const ecorche_pose* pose, uint32_t angle, double* radians);
/* The turn of a segment from the scan, in its joint's axes: a unit quaternion x, y, z, w. */
ECORCHE_API ecorche_code ecorche_pose_set_rotation(ecorche_pose* pose, uint32_t segment,
                                                   const double xyzw[4]);
ECORCHE_API ecorche_code ecorche_pose_rotation(const ecorche_pose* pose, uint32_t segment, double xyzw[4]);
/* Where the whole body goes from the scan: mm, LPS. */
ECORCHE_API ecorche_code ecorche_pose_set_root(ecorche_pose* pose, const double translation[3]);

/* ---- bodies ---- */

/* A posed body and all its buffers. */
typedef struct ecorche_body ecorche_body;

typedef struct ecorche_body_options {
  size_t struct_size;
  int32_t normals;  /* not 0: ecorche_body_normals has some; the default */
  uint32_t threads; /* that pose this body; 0: one a processor */
} ecorche_body_options;
#define ECORCHE_BODY_OPTIONS_INIT \
  { sizeof(ecorche_body_options), 1, 0 }

typedef enum ecorche_skinning {
  ECORCHE_SKINNING_LBS = 0, /* linear blend skinning */
  ECORCHE_SKINNING_DQS = 1, /* dual quaternions */
  ECORCHE_SKINNING_COR = 2  /* optimised centres of rotation: what is best */
} ecorche_skinning;

/* Allocates everything that a pose needs. `options` may be NULL. The body holds the scanned pose. */
ECORCHE_API ecorche_code ecorche_body_create(const ecorche_model* model, const ecorche_body_options* options,
                                             ecorche_body** out);
ECORCHE_API void ecorche_body_destroy(ecorche_body* body);

/* Poses the tissues whose rows are in `tissues`, ascending (NULL: all). The pose is brought within the
 * joints' limits and its couplings are set. Allocates nothing. */
ECORCHE_API ecorche_code ecorche_body_update(ecorche_body* body, const ecorche_pose* pose,
                                             ecorche_skinning skinning, const uint32_t* tissues,
                                             size_t tissue_count);

/* 3 * vertex_count, LPS mm; NULL where the last update did not pose the tissue. */
ECORCHE_API const float* ecorche_body_positions(const ecorche_body* body, uint32_t tissue);
/* 3 * vertex_count unit vectors in 32767ths; NULL where there are none. */
ECORCHE_API const int16_t* ecorche_body_normals(const ecorche_body* body, uint32_t tissue);
/* Into the caller's vertices, in the caller's space: `positions` and `normals` are the first vertex's three
 * floats, `stride` bytes from one vertex to the next (0: 12), either may be NULL; room for `capacity`
 * vertices. Normals have the length 1. INVALID_ARGUMENT where that is too little. Allocates nothing. */
ECORCHE_API ecorche_code ecorche_body_copy(const ecorche_body* body, uint32_t tissue, ecorche_space space,
                                           float* positions, size_t position_stride, float* normals,
                                           size_t normal_stride, size_t capacity);
/* The motion of a segment from the scan, LPS mm: 3 rows of 4. */
ECORCHE_API ecorche_code ecorche_body_motion(const ecorche_body* body, uint32_t segment, double matrix[12]);

/* What limits took away: joints, and the turn between what was asked and what was done, radians. */
ECORCHE_API uint32_t ecorche_body_clamped_count(const ecorche_body* body);
ECORCHE_API ecorche_code ecorche_body_clamped(const ecorche_body* body, uint32_t row, uint32_t* segment,
                                              double* removed);

/* ---- quality ---- */

/* How far a pose can be believed. */
typedef struct ecorche_quality {
  size_t struct_size;
  int32_t pass; /* 0: warn, for the reasons of ecorche_body_reason */
  uint32_t reason_count;
  uint64_t inverted_tets;
  double inverted_share; /* of the volume */
  double min_det_f;      /* least posed over rest volume of a tet */
  double volume_change;  /* share */
  double bone_rigidity;  /* mm */
  double bone_overlap;   /* mm: how much deeper than in the scan a bone lies in another; NaN: a server that
                            has just started has not looked yet */
} ecorche_quality;
#define ECORCHE_QUALITY_INIT \
  { sizeof(ecorche_quality), 0, 0, 0, 0, 0, 0, 0, 0 }

/* Of the last update. `sampled`: on 8192 tets and some of the bones' vertices, in a fraction of a frame but for
 * the first time that bones move against each other; else on all. Tissues count that were posed. */
ECORCHE_API ecorche_code ecorche_body_measure(ecorche_body* body, int sampled, ecorche_quality* out);

typedef struct ecorche_reason {
  size_t struct_size;
  const char* figure; /* inverted_share, place_inverted, place_change, volume_change, tissue_change,
                         doubtful_joint, bone_overlap or bone_rigidity */
  const char* name;   /* of the tissue, the joint or the bone, or "" */
  double value, threshold;
} ecorche_reason;
#define ECORCHE_REASON_INIT \
  { sizeof(ecorche_reason), 0, 0, 0, 0 }

/* Of the last measure: what is beyond its threshold, the worst tissues first. */
ECORCHE_API ecorche_code ecorche_body_reason(const ecorche_body* body, uint32_t row, ecorche_reason* out);

/* ---- volumes ---- */

typedef enum ecorche_scalar {
  ECORCHE_U8 = 0,
  ECORCHE_I8 = 1,
  ECORCHE_U16 = 2,
  ECORCHE_I16 = 3,
  ECORCHE_U32 = 4,
  ECORCHE_I32 = 5,
  ECORCHE_F32 = 6,
  ECORCHE_F64 = 7
} ecorche_scalar;

/* Where voxels lie: (i, j, k) is centred at origin + direction * (spacing .* (i, j, k)), LPS mm. */
typedef struct ecorche_grid {
  int32_t size[3];     /* i runs fastest in memory */
  double origin[3];    /* mm */
  double spacing[3];   /* mm, positive */
  double direction[9]; /* row by row, orthonormal; its columns are the axes of i, j, k */
} ecorche_grid;

typedef struct ecorche_volume_info {
  size_t struct_size;
  const char* name;
  ecorche_scalar type;
  int32_t components; /* of a voxel, side by side */
  int32_t labels;     /* not 0: ids, posed by the nearest voxel only */
  double background;  /* what lies outside the body */
  ecorche_grid grid;  /* of the scan */
  const void* rest;   /* voxels of the scan */
} ecorche_volume_info;
#define ECORCHE_VOLUME_INFO_INIT                                          \
  {                                                                       \
    sizeof(ecorche_volume_info), 0, ECORCHE_U8, 0, 0, 0,                  \
        {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 0}}, 0 \
  }

ECORCHE_API uint32_t ecorche_model_volume_count(const ecorche_model* model);
ECORCHE_API ecorche_code ecorche_model_volume(const ecorche_model* model, uint32_t volume,
                                              ecorche_volume_info* out);
/* The scan's own lattice, grown in whole voxels until it holds the posed body. */
ECORCHE_API ecorche_code ecorche_body_volume_grid(const ecorche_body* body, uint32_t volume,
                                                  ecorche_grid* out);
/* The posed volume on any grid: the one above, a region, or a slice (one voxel thick). `voxels` has room for
 * `bytes`, at least those of the grid: voxels * components * bytes of a scalar. `nearest`: not 0 for no
 * interpolation. Allocates nothing where the last grid was as large. */
ECORCHE_API ecorche_code ecorche_body_volume(ecorche_body* body, uint32_t volume, const ecorche_grid* grid,
                                             int nearest, void* voxels, size_t bytes);

/* ---- volumes by spheres ---- */

/* An object as the balls around a few of its voxels (its volumetric skeleton: Gagvani and Silver 2001), each
 * hung on a segment. Never changes; may be used by any number of threads at once; keeps its model alive. */
typedef struct ecorche_spheres ecorche_spheres;

/* Those with which the model's volume is posed. FAILED_PRECONDITION where the model was prepared without any.
 */
ECORCHE_API ecorche_code ecorche_spheres_of_volume(const ecorche_model* model, uint32_t volume,
                                                   ecorche_spheres** out);
/* Thins an object of one's own: `inside` has a byte for each voxel of `grid`, not 0 where it is the object.
 * `thinness`, voxels: -2 keeps every voxel, 2 none; 0.3 to 1 is usual, 0.48 keeps some three in a thousand.
 * Each ball hangs on the segment whose skinning weight is largest there. INVALID_ARGUMENT where no ball is
 * left, for voxels that are not cubic, and beyond 2^31 of them. Takes seconds for 256 * 256 * 256. */
ECORCHE_API ecorche_code ecorche_spheres_thin(const ecorche_model* model, const ecorche_grid* grid,
                                              const uint8_t* inside, double thinness, ecorche_spheres** out);
/* What thinning at a higher thinness would have left, from the balls alone. */
ECORCHE_API ecorche_code ecorche_spheres_thinner(const ecorche_spheres* spheres, double thinness,
                                                 ecorche_spheres** out);
/* The same balls, hung on other segments: a row of the model for each ball. */
ECORCHE_API ecorche_code ecorche_spheres_hang(const ecorche_spheres* spheres, const int32_t* segments,
                                              size_t count, ecorche_spheres** out);
ECORCHE_API void ecorche_spheres_destroy(ecorche_spheres* spheres);

typedef struct ecorche_spheres_info {
  size_t struct_size;
  uint32_t count;          /* of balls */
  double thinness;         /* that they were thinned at */
  ecorche_grid grid;       /* of the voxels that were thinned */
  const uint16_t* voxels;  /* 3 * count: i, j, k of the centres */
  const float* radii;      /* count, mm: a ball holds what is nearer to its centre */
  const int32_t* segments; /* count: the rows that they hang on */
} ecorche_spheres_info;
#define ECORCHE_SPHERES_INFO_INIT                                                                          \
  {                                                                                                        \
    sizeof(ecorche_spheres_info), 0, 0, {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 0}}, 0, \
        0, 0                                                                                               \
  }

ECORCHE_API ecorche_code ecorche_spheres_describe(const ecorche_spheres* spheres, ecorche_spheres_info* out);

/* Where the volume lies after the body's last update, when the balls pose it: the scan's own lattice, or
 * cubes of its finest spacing where its voxels are not cubic, grown until it holds every ball; or the voxels
 * of it whose centres lie in `region`, 6: the low and the high corner, both ends included, LPS mm (NULL:
 * all). INVALID_ARGUMENT for a region without any. */
ECORCHE_API ecorche_code ecorche_body_refill_grid(ecorche_body* body, const ecorche_spheres* spheres,
                                                  uint32_t volume, const double region[6], ecorche_grid* out);
/* The posed volume by the balls, beside ecorche_body_volume, which does it by tets: on a grid of the function
 * above (or another part of that lattice), or on a slice: one voxel thick along k, wherever it lies. What
 * opens between segments is bridged. The first call for a volume takes a moment longer, and each allocates
 * some 200 bytes a ball. The rest as ecorche_body_volume. */
ECORCHE_API ecorche_code ecorche_body_refill(ecorche_body* body, const ecorche_spheres* spheres,
                                             uint32_t volume, const ecorche_grid* grid, int nearest,
                                             void* voxels, size_t bytes);

/* ---- probes ---- */

/* The caller's buffers, a row for each point; those that are NULL are left out. */
typedef struct ecorche_probed {
  size_t struct_size;
  float* points;    /* 3: where the point is on the other side, LPS mm; NaN outside the body */
  int32_t* tets;    /* that holds it; -1 outside */
  int32_t* tissues; /* the innermost closed tissue that holds it; -1 outside */
  float* gradients; /* 9, row by row: d posed / d rest; NaN outside */
  double* values;   /* of `volume` there, its components side by side; its background outside */
  int32_t volume;   /* that is sampled where `values` is not NULL */
} ecorche_probed;
#define ECORCHE_PROBED_INIT \
  { sizeof(ecorche_probed), 0, 0, 0, 0, 0, 0 }

/* `points`: 3 * `count`, LPS mm, in the posed body: where were they in the scan, and what is there? At most
 * 2^32 - 1 of them. */
ECORCHE_API ecorche_code ecorche_body_posed_to_rest(ecorche_body* body, const float* points, size_t count,
                                                    ecorche_probed* out);
/* Points of the scan: where did they go? */
ECORCHE_API ecorche_code ecorche_body_rest_to_posed(ecorche_body* body, const float* points, size_t count,
                                                    ecorche_probed* out);

#ifdef __cplusplus
}
#endif

#endif
