# SPDX-License-Identifier: Apache-2.0
"""Every mistake: its name, what it changes in a good case, the command, the exit code, and what the error line says."""
import math
import struct

import body

CHECK = ("check", "CASE")
PREPARE = ("preprocess", "CASE", "-o", "OUT/m.hdf", "--mesher", "lattice", "--max-tets", "5000")
POSE = ("pose", "MODEL", "-o", "OUT/posed", "--pose", "CASE/pose.yaml")
MOVE = ("pose", "MODEL", "-o", "OUT/posed", "--motion", "CASE/clip.bvh", "--frames", "0:2")


def put(name, data):
    """The file `name` becomes `data`."""
    def change(folder):
        (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)
    return change


def swap(name, old, new):
    """In the text file `name`, the first `old` becomes `new`."""
    def change(folder):
        text = (folder / name).read_text()
        assert old in text, (name, old)
        (folder / name).write_text(text.replace(old, new, 1))
    return change


def cut(name, keep):
    def change(folder):
        (folder / name).write_bytes((folder / name).read_bytes()[:keep])
    return change


def gone(name):
    return lambda folder: (folder / name).unlink()


def none(folder):
    pass


def spoilt(value):
    triangles = list(body.SURFACES["skin.stl"])
    first = triangles[0]
    triangles[0] = ((value, 0.0, 0.0), first[1], first[2])
    return triangles


def counted(count):
    data = bytearray(body.stl(body.SURFACES["skin.stl"]))
    data[80:84] = struct.pack("<I", count)
    return bytes(data)


def skeleton(old, new):
    return swap("skeleton.yaml", old, new)


BOMB = body.nrrd(bytes(256 << 20), encoding="gzip")
VOXELS = bytes(120)

SURFACE_ROWS = [
    ("surface_empty", put("skin.stl", b""), CHECK, 65, "is no STL: 0 bytes"),
    ("surface_short_header", put("skin.stl", b"x" * 40), CHECK, 65, "is no STL: 40 bytes"),
    ("surface_truncated", cut("skin.stl", 300), CHECK, 65, "triangles, which take"),
    ("surface_absurd_count", put("skin.stl", counted(4000000000)), CHECK, 65, "says 4000000000 triangles"),
    ("surface_no_triangle", put("skin.stl", body.stl([])), CHECK, 65, "has no triangle"),
    ("surface_nan_binary", put("skin.stl", body.stl(spoilt(math.nan))), PREPARE, 65, "has the coordinate nan"),
    ("surface_inf_binary", put("femur_right.stl", body.stl(spoilt(math.inf))), CHECK, 65, "has the coordinate inf"),
    ("surface_nan_text", put("skin.stl", body.stl_text(spoilt(math.nan))), CHECK, 65, "nan"),
    ("surface_text_where_binary", put("skin.stl", "facets of a knee, as I drew them\n" * 9), CHECK, 65, "skin.stl"),
    ("surface_text_cut", put("skin.stl", body.stl_text(body.SURFACES["skin.stl"])[:400]), CHECK, 65, "the file ends"),
    ("surface_text_word", put("skin.stl", "solid a\nfacet normal 0 0 0\nouter ring\n"), CHECK, 65, "expected 'loop'"),
    ("surface_text_number", put("skin.stl", "solid a\nfacet normal 0 0 zero\n"), CHECK, 65, "expected a number"),
    ("surface_is_a_folder", lambda f: ((f / "skin.stl").unlink(), (f / "skin.stl").mkdir()), CHECK, 66, "no such file"),
    ("surface_format_unknown", lambda f: (swap("case.yaml", "skin: skin.stl", "skin: skin.xyz")(f),
                                          (f / "skin.xyz").write_text("1 2 3")), CHECK, 65, "surfaces cannot be read"),
    ("surface_absent", gone("femur_right.stl"), PREPARE, 66, "no such file"),
]

IMAGE_ROWS = [
    ("image_empty", put("ct.nrrd", b""), CHECK, 65, "ct.nrrd"),
    ("image_is_a_zip", put("ct.nrrd", b"PK\x03\x04" * 50), CHECK, 65, "is no NRRD: its first line is not NRRD0001 to NRRD0005"),
    ("image_truncated_raw", put("ct.nrrd", body.nrrd(VOXELS[:50])), CHECK, 65, "declares 120 bytes of voxels, but has 50"),
    ("image_too_long", put("ct.nrrd", body.nrrd(VOXELS + b"more")), CHECK, 65, "but has 124"),
    ("image_truncated_gzip", put("ct.nrrd", body.nrrd(bytes(range(120)), encoding="gzip")[:-20]), CHECK, 65, "compressed data hold"),
    ("image_damaged_gzip", put("ct.nrrd", body.nrrd(VOXELS).replace(b"raw", b"gzip")), CHECK, 65, "compressed voxels are damaged"),
    ("image_zip_bomb", put("ct.nrrd", BOMB), CHECK, 65, "but its compressed data hold more"),
    ("image_absurd_sizes", put("ct.nrrd", body.nrrd(VOXELS, (30000, 30000, 30000))), CHECK, 65, "ct.nrrd"),
    ("image_absurd_gzip", put("ct.nrrd", body.nrrd(VOXELS, (1500, 1000, 1000), encoding="gzip")), CHECK, 65, "cannot hold them"),
    ("image_negative_size", put("ct.nrrd", body.nrrd(VOXELS, (4, -3, 5))), CHECK, 65, "ct.nrrd"),
    ("image_overflowing_size", put("ct.nrrd", body.nrrd(VOXELS, sizes="99999999999999999999 1 1")), CHECK, 65, "ct.nrrd"),
    ("image_no_sizes", put("ct.nrrd", body.nrrd(VOXELS, sizes=None)), CHECK, 65, "lacks 'sizes'"),
    ("image_two_axes", put("ct.nrrd", body.nrrd(VOXELS, dimension=2)), CHECK, 65, "has 2 axes"),
    ("image_type_unknown", put("ct.nrrd", body.nrrd(VOXELS, kind="block")), CHECK, 65, "voxels of type 'block'"),
    ("image_encoding_unknown", put("ct.nrrd", body.nrrd(VOXELS, encoding="bzip2")), CHECK, 65, "its encoding is 'bzip2'"),
    ("image_skewed", put("ct.nrrd", body.nrrd(VOXELS, space_directions="(20,90,0) (0,25,0) (0,0,40)")), CHECK, 65, "not orthonormal"),
    ("image_flat_axis", put("ct.nrrd", body.nrrd(VOXELS, space_directions="(0,0,0) (0,25,0) (0,0,40)")), CHECK, 65, "ct.nrrd"),
    ("image_nan_origin", put("ct.nrrd", body.nrrd(VOXELS, space_origin="(nan,0,0)")), CHECK, 65, "ct.nrrd"),
    ("image_header_endless", put("ct.nrrd", b"NRRD0004\n" + b"# and so on\n" * 9000), CHECK, 65, "header does not end"),
    ("image_outside_file", put("ct.nrrd", body.nrrd(b"", data_file="/etc/hostname")), CHECK, 65, "/etc/hostname"),
    ("image_format_unknown", lambda f: (swap("case.yaml", "ct.nrrd", "ct.raw")(f), (f / "ct.raw").write_bytes(VOXELS)),
     CHECK, 65, "images cannot be read"),
    ("mha_no_data_line", put("labels.mha", body.mha(b"", ElementDataFile=None)), CHECK, 65, "ElementDataFile"),
    ("mha_text_voxels", put("labels.mha", body.mha(bytes(60), BinaryData="False")), CHECK, 65, "voxels are text"),
    ("mha_type_unknown", put("labels.mha", body.mha(bytes(60), ElementType="MET_STRING")), CHECK, 65, "MET_STRING"),
    ("mha_truncated", put("labels.mha", body.mha(bytes(30))), CHECK, 65, "labels.mha"),
    ("labels_form_unknown", swap("case.yaml", "labels: {file: labels.mha,", "labels: {file: labels.mha, form: both,"), CHECK, 78,
     "'both' is no form of a NIfTI (write qform or sform)"),
    ("labels_of_floats", put("labels.mha", body.mha(struct.pack("<60f", *[0.5] * 60), ElementType="MET_FLOAT")), CHECK, 65, "labels.mha: 60 of 60 labels are no whole numbers, the first 0.5 at voxel (0, 0, 0)"),
]

CASE_ROWS = [
    ("case_empty", put("case.yaml", ""), CHECK, 78, "is empty"),
    ("case_is_binary", put("case.yaml", bytes(range(256)) * 4), CHECK, 78, "case.yaml"),
    ("case_is_a_list", put("case.yaml", "[a, b]"), CHECK, 78, "must be a map, is a list"),
    ("case_half_a_line", cut("case.yaml", 90), CHECK, 78, "case.yaml:7"),
    ("case_yaml_bomb", put("case.yaml", "a: &a [x, x]\nb: &b [*a, *a]\n"), CHECK, 78, "an anchor"),
    ("case_too_deep", put("case.yaml", "a: " + "[" * 100 + "]" * 100), CHECK, 78, "nested deeper"),
    ("case_unknown_key", swap("case.yaml", "unit: mm", "units: mm"), PREPARE, 78, "did you mean 'unit'?"),
    ("case_unknown_unit", swap("case.yaml", "unit: mm", "unit: furlong"), CHECK, 78, "'furlong' is no unit"),
    ("case_unknown_frame", swap("case.yaml", "frame: LPS", "frame: XYZ"), CHECK, 78, "'XYZ' is no frame"),
    ("case_frame_twice_one_axis", swap("case.yaml", "frame: LPS", "frame: LRS"), CHECK, 78, "'LRS' is no frame"),
    ("case_unknown_frame_option", none, CHECK + ("--frame", "UVW"), 64, "'UVW' is no frame"),
    ("case_unknown_segment", swap("case.yaml", "segment: thigh_right", "segment: thigh_rigth"), CHECK, 78, "did you mean 'thigh_right'?"),
    ("case_unknown_group", swap("case.yaml", "group: muscle", "group: sinew"), CHECK, 78, "unknown group 'sinew'"),
    ("case_same_name_twice", swap("case.yaml", "name: femur_right", "name: pelvis_bone"), CHECK, 78, "is named already"),
    ("case_tissue_named_skin", swap("case.yaml", "name: muscle_a", "name: skin"), CHECK, 78, "'skin' is named already"),
    ("case_bad_identifier", swap("case.yaml", "name: muscle_a", "name: 'Muscle A'"), CHECK, 78, "is no identifier"),
    ("case_data_folder_unknown", swap("case.yaml", "skin: skin.stl", "skin: {file: skin.stl, root: data}"), CHECK, 78, "--data DIR"),
    ("case_label_id_word", swap("case.yaml", "{1: pelvis_bone", "{one: pelvis_bone"), CHECK, 78, "'one' is no label id"),
    ("case_label_id_twice", swap("case.yaml", "{1: pelvis_bone, 2:", "{1: pelvis_bone, 01:"), CHECK, 78, "stands twice"),
    ("case_volume_twice", swap("case.yaml", "labels:", "  - {name: ct, file: ct.nrrd}\nlabels:"), CHECK, 78, "another volume is named 'ct'"),
    ("case_volume_named_labels", swap("case.yaml", "name: ct", "name: labels"), CHECK, 78, "is the label map's name"),
    ("case_key_of_a_list", put("case.yaml", "[a, b]: c\n"), CHECK, 78, "a key that is no plain word"),
    ("case_two_documents", swap("case.yaml", "skin:", "---\nskin:"), CHECK, 78, "case.yaml"),
    ("case_key_twice", swap("case.yaml", "unit: mm", "unit: mm\nunit: cm"), CHECK, 78, "the key 'unit' stands twice"),
    ("case_no_bones", swap("case.yaml", "bones:", "bones: []\nbanes:"), CHECK, 78, "banes"),
    ("case_name_is_a_map", swap("case.yaml", "name: small", "name: {a: b}"), CHECK, 78, "must be a plain value"),
    ("case_absent", gone("case.yaml"), CHECK, 66, "case.yaml"),
    ("case_name_empty", swap("case.yaml", "name: small", "name: ''"), CHECK, 78, "is empty (write a word)"),
    ("case_skeleton_absent", gone("skeleton.yaml"), CHECK, 66, "skeleton.yaml"),
    ("case_skin_far_away", put("femur_right.stl", body.stl(body.box((900, 900, 900), (950, 950, 950)))),
     ("check", "CASE", "--frame", "L"), 64, "'L' is no frame"),
]

SKELETON_ROWS = [
    ("skeleton_cyclic", skeleton("  pelvis:\n", "  a: {parent: b, joint: {name: ja, kind: ball, center: [0, 0, 0]}}\n"
                                 "  b: {parent: a, joint: {name: jb, kind: ball, center: [0, 0, 0]}}\n  pelvis:\n"), CHECK, 78,
     "is among its own ancestors"),
    ("skeleton_only_a_cycle", skeleton("  pelvis:\n", "  pelvis:\n    parent: thigh_right\n"), CHECK, 78, "skeleton.yaml:"),
    ("skeleton_two_roots", skeleton("    parent: pelvis\n", ""), CHECK, 78, "has no parent, but 'pelvis'"),
    ("skeleton_unknown_parent", skeleton("parent: pelvis", "parent: pelvsi"), CHECK, 78, "pelvsi"),
    ("skeleton_same_segment_twice", skeleton("  thigh_right:", "  pelvis:"), CHECK, 78, "the key 'pelvis' stands twice"),
    ("skeleton_same_joint_twice", skeleton("name: hip_right", "name: root"), CHECK, 78, "another joint is named 'root'"),
    ("skeleton_unknown_kind", skeleton("kind: ball", "kind: bull"), CHECK, 78, "did you mean 'ball'?"),
    ("skeleton_version", skeleton("ecorche_skeleton: 1", "ecorche_skeleton: 9"), CHECK, 78, "version '9' is not known"),
    ("skeleton_version_word", skeleton("ecorche_skeleton: 1", "ecorche_skeleton: one"), CHECK, 78, "version 'one' is not known"),
    ("skeleton_left_handed", skeleton("      sequence", "      axes: {x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, -1]}\n      sequence"), CHECK, 78,
     "skeleton.yaml:"),
    ("skeleton_axis_of_no_length", skeleton("      sequence", "      axes: {x: [0, 0, 0], z: [0, 0, 1]}\n      sequence"), CHECK, 78,
     "has no length"),
    ("skeleton_no_segments", put("skeleton.yaml", "ecorche_skeleton: 1\nname: small\nsegments: {}\n"), CHECK, 78, "is empty (a skeleton has at least a root)"),
    ("skeleton_unknown_axis", skeleton("flexion: x", "flexion: w"), CHECK, 78, "'w' is no axis"),
    ("skeleton_axis_twice", skeleton("adduction: y", "adduction: x"), CHECK, 78, "turns about the same axis again"),
    ("skeleton_limits_reversed", skeleton("[-20, 120]", "[120, -20]"), CHECK, 78, "the least angle is above the most"),
    ("skeleton_limits_three", skeleton("[-20, 120]", "[-20, 0, 120]"), CHECK, 78, "has 3 values"),
    ("skeleton_limits_without_rest", skeleton("[-20, 120]", "[20, 120]"), CHECK, 78, "rest angle"),
    ("skeleton_unknown_angle", skeleton("{flexion: [", "{flection: ["), CHECK, 78, "did you mean 'flexion'?"),
    ("skeleton_nan_centre", skeleton("[0, 0, 15]", "[0, 0, .nan]"), CHECK, 78, "must be a number"),
    ("skeleton_centre_of_two", skeleton("[0, 0, 15]", "[0, 15]"), CHECK, 78, "has 2 values"),
    ("skeleton_fit_of_unknown_bone", skeleton("[0, 0, 15]", "{sphere_fit: {bone: femur, facing: pelvis_bone}}"), CHECK, 78, "femur"),
    ("skeleton_fit_faces_itself", skeleton("[0, 0, 15]", "{sphere_fit: {bone: femur_right, facing: femur_right}}"), CHECK, 78,
     "cannot face itself"),
    ("skeleton_leads_itself", skeleton("      limits_deg", "      coupled:\n        - {joint: hip_right, angle: flexion, "
                                       "drives: rotation, ratio: 1}\n      limits_deg"), CHECK, 78, "cannot lead itself"),
]

PREPARE_ROWS = [
    ("prepare_flat_skin", put("skin.stl", body.stl(body.box((-50, -40, 0), (50, 40, 0)))), CHECK, 65, None),
    ("prepare_bones_elsewhere", lambda f: [(f / n).write_bytes(body.stl(body.box((9000, 0, 0), (9010, 10, 10))))
                                           for n in ("femur_right.stl", "pelvis_bone.stl")], CHECK, 65, None),
    ("prepare_output_no_hdf", none, ("preprocess", "CASE", "-o", "OUT/m.vtk"), 64, "does not end in .hdf"),
    ("prepare_output_is_a_folder", lambda f: (f.parent / "out" / "m.hdf").mkdir(), PREPARE, 73, "is a folder"),
    ("prepare_output_folder_absent", none, ("preprocess", "CASE", "-o", "OUT/no/m.hdf"), 73, "cannot write here"),
    ("prepare_mesher_unknown", none, PREPARE + ("--mesher", "magic"), 64, "magic"),
    ("prepare_solver_unknown", none, PREPARE + ("--solver", "magic"), 64, "magic"),
    ("prepare_voxel_negative", none, PREPARE + ("--voxel", "-1"), 64, "--voxel"),
    ("prepare_voxel_word", none, PREPARE + ("--voxel", "fine"), 64, "--voxel"),
    ("prepare_voxel_too_fine", lambda f: put("skin.stl", body.stl(body.box((-5e4, -4e4, -1e5), (5e4, 4e4, 1e5))))(f),
     PREPARE + ("--voxel", "0.05"), 78, "use coarser voxels"),
    ("prepare_too_few_tets", none, PREPARE + ("--max-tets", "10"), 64, "--max-tets"),
    ("prepare_weights_unknown", none, PREPARE + ("--weights", "magic"), 64, "--weights"),
    ("prepare_sigma", none, PREPARE + ("--cor-sigma", "0.5"), 64, "--cor-sigma"),
    ("prepare_threads", none, PREPARE + ("--threads", "-3"), 64, "--threads"),
    ("repair_over_its_input", none, ("repair", "CASE", "-o", "CASE"), 64, "holds the input"),
    ("repair_without_output", none, ("repair", "CASE"), 64, "--output"),
    ("repair_over_another_case", lambda f: (f.parent / "out" / "case.yaml").write_text("x"), ("repair", "CASE", "-o", "OUT"), 73,
     "holds a case already"),
    ("repair_negative_weld", none, ("repair", "CASE", "-o", "OUT/r", "--weld", "-1"), 64, "--weld"),
    ("phantom_over_other_files", none, ("phantom", "-o", "CASE", "--size", "small"), 73, "holds files, but no phantom"),
    ("phantom_is_a_file", none, ("phantom", "-o", "CASE/case.yaml", "--size", "small"), 73, "is a file"),
    ("phantom_size", none, ("phantom", "-o", "OUT/p", "--size", "huge"), 64, "huge"),
    ("no_subcommand", none, (), 64, "subcommand"),
    ("unknown_subcommand", none, ("dance",), 64, "subcommand"),
    ("unknown_option", none, CHECK + ("--fast",), 64, "--fast"),
]

MOTION_ROWS = [
    ("pose_empty", put("pose.yaml", ""), POSE, 78, "is empty"),
    ("pose_version", swap("pose.yaml", "ecorche_pose: 1", "ecorche_pose: 2"), POSE, 78, "version '2' is not known"),
    ("pose_of_another_skeleton", swap("pose.yaml", "skeleton: small", "skeleton: horse"), POSE, 78, "the model has 'small'"),
    ("pose_unknown_joint", swap("pose.yaml", "hip_right:", "hip_rigth:"), POSE, 78, "did you mean 'hip_right'?"),
    ("pose_unknown_angle", swap("pose.yaml", "flexion_deg", "flection_deg"), POSE, 78, "did you mean 'flexion_deg'?"),
    ("pose_zero_quaternion", swap("pose.yaml", "{flexion_deg: 30}", "{rotation: [0, 0, 0, 0]}"), POSE, 78, "is a quaternion of length 0"),
    ("pose_both_ways", swap("pose.yaml", "{flexion_deg: 30}", "{flexion_deg: 30, rotation: [1, 0, 0, 0]}"), POSE, 78,
     "gives a rotation and angles"),
    ("pose_nan", swap("pose.yaml", "flexion_deg: 30", "flexion_deg: .nan"), POSE, 78, "must be a number"),
    ("pose_translation_of_two", swap("pose.yaml", "[0, 0, 10]", "[0, 10]"), POSE, 78, "has 2 values"),
    ("pose_absent", gone("pose.yaml"), POSE, 66, "pose.yaml"),
    ("pose_nothing", none, ("pose", "MODEL", "-o", "OUT/p"), 64, "nothing to pose"),
    ("pose_both_sources", none, POSE + ("--motion", "CASE/clip.bvh", "--frames", "0"), 64, "both --pose and --motion"),
    ("pose_no_frames", none, MOVE[:6], 64, "no frames are named"),
    ("pose_frames_word", none, MOVE[:7] + ("a:b",), 64, "is not A, A:B or A:B:STEP"),
    ("pose_frames_beyond", none, MOVE[:7] + ("7:9",), 64, "names no frames of this motion"),
    ("pose_unknown_tissue", none, POSE + ("--tissues", "liver"), 64, "the model has no 'liver'"),
    ("pose_unknown_volume", none, POSE + ("--volumes", "mr"), 64, "the model has no 'mr'"),
    ("pose_unknown_skinning", none, POSE + ("--skinning", "fem2"), 64, "--skinning"),
    ("pose_unknown_format", none, POSE + ("--format", "docx"), 64, "--format"),
    ("pose_below_a_file", none, ("pose", "MODEL", "-o", "CASE/case.yaml/posed", "--pose", "CASE/pose.yaml"), 73, "cannot make this folder"),
    ("pose_into_a_file", none, ("pose", "MODEL", "-o", "CASE/case.yaml", "--pose", "CASE/pose.yaml"), 73, "case.yaml"),
    ("bvh_empty", put("clip.bvh", ""), MOVE, 65, "the file ends"),
    ("bvh_binary", put("clip.bvh", bytes(range(256))), MOVE, 65, "clip.bvh"),
    ("bvh_truncated", cut("clip.bvh", 180), MOVE, 65, "clip.bvh:"),
    ("bvh_frames_lie", swap("clip.bvh", "Frames: 3", "Frames: 60000000"), MOVE, 65, "clip.bvh:"),
    ("bvh_fewer_frames", swap("clip.bvh", "Frames: 3", "Frames: 4"), MOVE, 65, "clip.bvh:"),
    ("bvh_no_frames", swap("clip.bvh", "Frames: 3", "Frames: 0"), MOVE, 65, "has no frame"),
    ("bvh_time_zero", swap("clip.bvh", "0.0333", "0"), MOVE, 65, "frame time is not positive"),
    ("bvh_nan", swap("clip.bvh", "0 0 0 0 0 0 0 10 0", "0 0 0 0 0 0 0 nan 0"), MOVE, 65, "clip.bvh:"),
    ("bvh_huge", swap("clip.bvh", "0 10 0", "0 1e300 0"), MOVE, 65, "far too large"),
    ("bvh_channel_unknown", swap("clip.bvh", "Xposition", "Wposition"), MOVE, 65, "a channel such as Xrotation"),
    ("bvh_channel_twice", swap("clip.bvh", "Yposition", "Xposition"), MOVE, 65, "stands twice"),
    ("bvh_joint_twice", swap("clip.bvh", "JOINT thigh_right", "JOINT Hips"), MOVE, 65, "the joint 'Hips' stands twice"),
    ("bvh_of_nobody_here", lambda f: (swap("clip.bvh", "ROOT Hips", "ROOT tail")(f), swap("clip.bvh", "thigh_right", "fin")(f)), MOVE, 65,
     "no joint of the clip"),
    ("bvh_no_channels", put("clip.bvh", "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 0\n}\nMOTION\nFrames: 1\nFrame Time: 1\n"),
     MOVE, 65, "no joint has a channel"),
    ("bvh_no_name", swap("clip.bvh", "JOINT thigh_right", "JOINT"), MOVE, 65, "a joint has no name"),
    ("bvh_word", swap("clip.bvh", "End Site", "Start Site"), MOVE, 65, "JOINT, End Site or '}'"),
    ("bvh_number", swap("clip.bvh", "OFFSET 0 -20 0", "OFFSET 0 minus 0"), MOVE, 65, "expected a number, found 'minus'"),
    ("bvh_values_beyond", swap("clip.bvh", "Frames: 3", "Frames: 2"), MOVE, 65, "the file's end after the last frame"),
    ("bvh_nested_deep", put("clip.bvh", "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 0\n" + "".join(
        f"JOINT j{i}\n{{\nOFFSET 0 0 0\nCHANNELS 0\n" for i in range(9000))), MOVE, 65, "nested deeper"),
]
ROWS = SURFACE_ROWS + IMAGE_ROWS + CASE_ROWS + SKELETON_ROWS + PREPARE_ROWS + MOTION_ROWS
