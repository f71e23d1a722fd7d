#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Writes case.yaml and skeleton.yaml of bodyparts3d, right_leg and visible_human_male beside itself, from the data's own tables
and bones.

usage: make_cases.py DATA     (the folder that holds bodyparts3d/ and visible_human_male/; needs python3-vtk9, python3-numpy)

Joint centres: where two single bones face each other, hips and shoulders are sphere fits of `ecorche preprocess`; the others
are measured here, as each rule says.
"""
import csv
import pathlib
import re
import sys

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOGeometry import vtkSTLReader

HERE = pathlib.Path(__file__).parent
SPINE = "White and Panjabi, Clinical Biomechanics of the Spine (1990), rounded"
LIMBS = "AAOS, Joint Motion (1965), normal adult ranges, rounded"


def identifier(name):
    """`Navicular bone of left foot` -> navicular_bone_of_foot_left"""
    words = re.findall(r"[a-z0-9]+", name.lower())
    sides = [word for word in words if word in ("left", "right")]
    return "_".join([word for word in words if word not in ("left", "right")] + sides[:1])[:64]


def read_stl(path):
    reader = vtkSTLReader()
    reader.SetFileName(str(path))
    reader.Update()
    return vtk_to_numpy(reader.GetOutput().GetPoints().GetData()).astype(float)


class BodyParts3D:
    """Bones by their names in bones.csv; some in higher resolution."""

    def __init__(self, folder, better=None):
        self.folder, self.better = folder, better or {}
        self.rows = list(csv.DictReader((folder / "bones.csv").open()))
        self.by_name = {row["name"].lower(): row for row in self.rows}

    def vertices(self, name):
        name = name.lower()
        return read_stl(self.folder / self.better.get(name, self.by_name[name]["file"]))


class VisibleHuman:
    """x to the left, y up, z to the front: turned into LPS."""

    def __init__(self, folder):
        self.folder = folder

    def vertices(self, name):
        v = read_stl(self.folder / f"bones/{identifier(name)}.stl")
        return np.column_stack([v[:, 0], -v[:, 2], v[:, 1]])


def sphere(points):
    """Centre of the least-squares sphere."""
    system = np.column_stack([2 * points, np.ones(len(points))])
    return np.linalg.lstsq(system, (points**2).sum(axis=1), rcond=None)[0][:3]


def unit(v):
    return np.asarray(v, float) / np.linalg.norm(v)


def frame(x=None, z=None):
    """A right-handed frame whose x is `x`, or whose z is `z`, and whose other axis is as near as can be."""
    if z is None:
        x = unit(x)
        y = unit(np.cross([0, 0, 1], x))
        return np.column_stack([x, y, np.cross(x, y)])
    z = unit(z)
    y = unit(np.cross(z, [1, 0, 0] if x is None else x))
    return np.column_stack([np.cross(y, z), y, z])


def turns(axes):
    """Angles about x, then y, then z (intrinsic) that bring LPS to `axes`."""
    return np.array([np.arctan2(-axes[1, 2], axes[2, 2]), np.arcsin(np.clip(axes[0, 2], -1, 1)),
                     np.arctan2(-axes[0, 1], axes[0, 0])])


def text(v):
    return "[" + ", ".join(f"{x:.4g}" if abs(x) < 1.01 else f"{x:.1f}" for x in v) + "]"


class Skeleton:
    def __init__(self, name):
        self.lines = ["# SPDX-License-Identifier: Apache-2.0", "ecorche_skeleton: 1", f"name: {name}", "segments:"]

    def add(self, segment, parent, joint, kind, center, sequence, limits, source, axes=None, rest=None, aliases=(), coupled=()):
        self.lines.append(f"  {segment}:")
        if parent:
            self.lines.append(f"    parent: {parent}")
        self.lines += ["    joint:", f"      name: {joint}", f"      kind: {kind}"]
        self.lines.append(f"      center: {center if isinstance(center, str) else text(center)}")
        if axes is not None:
            self.lines.append(f"      axes: {{x: {text(axes[:, 0])}, z: {text(axes[:, 2])}}}")
        self.lines.append("      sequence: [" + ", ".join(f"{{{name}: {axis}}}" for name, axis in sequence) + "]")
        if rest:
            self.lines.append("      rest_deg: {" + ", ".join(f"{k}: {round(v, 1) + 0.0:g}" for k, v in rest.items()) + "}")
        if limits:
            bounds = ", ".join(f"{k}: [{a}, {b}]" for k, (a, b) in limits.items())
            self.lines.append(f'      limits_deg: {{{bounds}, source: "{source}"}}')
        if coupled:
            self.lines += ["      coupled:", *(f"        - {{joint: {by}, angle: {angle}, drives: {drives}, ratio: {ratio}}}" for by, angle, drives, ratio in coupled)]
        if aliases:
            self.lines.append("    aliases: [" + ", ".join(aliases) + "]")


def pelvis(skeleton, bones):
    hips = [sphere(head(bones, side)) for side in ("left", "right")]
    skeleton.add("pelvis", None, "pelvis", "free", np.mean(hips, axis=0), [("tilt", "x"), ("obliquity", "y"), ("rotation", "z")],
                 {}, "", aliases=["Hips", "hips"])


def trunk(skeleton, bones):
    middle = lambda name: bones.vertices(name).mean(axis=0)  # noqa: E731
    bend = [("flexion", "x"), ("lateral_bending", "y"), ("rotation", "z")]
    skeleton.add("lumbar", "pelvis", "lumbosacral", "ball", middle("Intervertebral disk of fifth lumbar vertebra"), bend,
                 {"flexion": (-30, 60), "lateral_bending": (-25, 25), "rotation": (-10, 10)}, SPINE, aliases=["LowerBack"])
    skeleton.add("thorax", "lumbar", "thoracolumbar", "ball", middle("Intervertebral disk of twelfth thoracic vertebra"), bend,
                 {"flexion": (-20, 40), "lateral_bending": (-25, 25), "rotation": (-35, 35)}, SPINE,
                 aliases=["Spine1", "Spine", "chest", "upperChest"])
    skeleton.add("neck", "thorax", "cervicothoracic", "ball", middle("Intervertebral disk of seventh cervical vertebra"), bend,
                 {"flexion": (-20, 40), "lateral_bending": (-30, 30), "rotation": (-45, 45)}, SPINE, aliases=["Neck", "Neck1"])
    atlas = bones.vertices("Atlas")
    skeleton.add("head", "neck", "atlantooccipital", "ball", [atlas[:, 0].mean(), atlas[:, 1].mean(), atlas[:, 2].max()], bend,
                 {"flexion": (-15, 30), "lateral_bending": (-15, 15), "rotation": (-45, 45)}, SPINE, aliases=["Head"])
    mandible = bones.vertices("Mandible")
    condyles = mandible[(mandible[:, 2] > mandible[:, 2].max() - 10) & (mandible[:, 1] > mandible[:, 1].max() - 12)]
    skeleton.add("jaw", "head", "temporomandibular", "hinge", condyles.mean(axis=0), [("opening", "x")], {"opening": (0, 35)},
                 "Okeson, Management of Temporomandibular Disorders (2013), rounded")


def head(bones, side):
    """Vertices of the femoral head: the upper, inner end."""
    femur = bones.vertices(f"{side} femur")
    inner = femur[:, 0] if side == "right" else -femur[:, 0]
    return femur[(femur[:, 2] > femur[:, 2].max() - 48) & (inner > inner.max() - 32)]


def arm(skeleton, bones, side):
    s = 1 if side == "left" else -1
    clavicle = bones.vertices(f"{side} clavicle")
    inner_end = clavicle[s * clavicle[:, 0] < (s * clavicle[:, 0]).min() + 12].mean(axis=0)
    sign = lambda axis, positive: axis if positive * s > 0 else "-" + axis  # noqa: E731
    skeleton.add(f"girdle_{side}", "thorax", f"sternoclavicular_{side}", "ball", inner_end,
                 [("axial_rotation", "-x"), ("depression", sign("y", 1)), ("protraction", sign("z", -1))],
                 {"axial_rotation": (-10, 45), "depression": (-45, 10), "protraction": (-30, 30)}, LIMBS,
                 aliases=[f"{side.capitalize()}Shoulder", f"{side}Shoulder"])
    humerus = bones.vertices(f"{side} humerus")
    upper = humerus[humerus[:, 2] > humerus[:, 2].max() - 40].mean(axis=0)
    trochlea = humerus[humerus[:, 2] < humerus[:, 2].min() + 18]
    elbow = trochlea.mean(axis=0)
    along = upper - elbow
    axes = frame(z=along)
    angles = np.degrees(turns(axes))
    skeleton.add(f"upper_arm_{side}", f"girdle_{side}", f"shoulder_{side}", "ball",
                 f"{{sphere_fit: {{bone: humerus_{side}, facing: scapula_{side}}}}}",
                 [("flexion", "-x"), ("adduction", sign("y", 1)), ("rotation", sign("z", -1))],
                 {"flexion": (-60, 180), "adduction": (-180, 45), "rotation": (-90, 90)}, LIMBS, axes,
                 {"flexion": -angles[0], "adduction": s * angles[1], "rotation": -s * angles[2]},
                 [f"{side.capitalize()}Arm", f"{side}UpperArm"])
    # The hinge runs along the widest extent of the humerus' lower end, across its shaft.
    flat = trochlea - elbow
    flat -= np.outer(flat @ unit(along), unit(along))
    across = np.linalg.svd(flat, full_matrices=False)[2][0]
    across *= np.sign(across[0])
    wrist = np.vstack([bones.vertices(f"{side} {name}") for name in ("scaphoid", "lunate")]).mean(axis=0)
    bent = np.degrees(np.arccos(np.clip(unit(along) @ unit(elbow - wrist), -1, 1)))
    skeleton.add(f"forearm_{side}", f"upper_arm_{side}", f"elbow_{side}", "hinge", elbow, [("flexion", "-x")],
                 {"flexion": (0, 150)}, LIMBS, frame(across, elbow - wrist), {"flexion": bent},
                 [f"{side.capitalize()}ForeArm", f"{side}LowerArm"])
    # The palm: the plane through wrist, second and fifth knuckles.
    knuckle = {n: bones.vertices(f"{side} {n} metacarpal bone") for n in ("second", "fifth")}
    tips = {n: v[np.argsort(((v - wrist) ** 2).sum(axis=1))[-40:]].mean(axis=0) for n, v in knuckle.items()}
    palm = frame(s * unit(tips["second"] - tips["fifth"]), wrist - (tips["second"] + tips["fifth"]) / 2)
    if palm[0, 0] < 0:
        palm[:, :2] *= -1
    skeleton.add(f"hand_{side}", f"forearm_{side}", f"wrist_{side}", "universal", wrist,
                 [("flexion", "-x"), ("deviation", sign("y", -1))], {"flexion": (-70, 80), "deviation": (-20, 30)}, LIMBS, palm,
                 aliases=[f"{side.capitalize()}Hand", f"{side}Hand"])


def leg(skeleton, bones, side, hip_bone=None, root=False, foot=True, patella=False):
    """`hip_bone`: the single bone that holds the head of the femur, for a sphere fit; `root`: the thigh has no parent; `patella`: it is a segment
    of its own, which glides about the condyles by seven tenths of the knee's flexion. On the shank it is pressed into them."""
    s = 1 if side == "left" else -1
    sign = lambda axis, positive: axis if positive * s > 0 else "-" + axis  # noqa: E731
    hip = sphere(head(bones, side))
    femur = bones.vertices(f"{side} femur")
    low = femur[femur[:, 2] < femur[:, 2].min() + 38]
    back = low[low[:, 1] > np.median(low[:, 1])]
    inner = back[s * back[:, 0] < s * np.median(back[:, 0])]
    outer = back[s * back[:, 0] > s * np.median(back[:, 0])]
    condyles = [sphere(inner), sphere(outer)]
    knee = np.mean(condyles, axis=0)
    axes = frame(z=hip - knee)
    angles = np.degrees(turns(axes))
    skeleton.add(f"thigh_{side}", None if root else "pelvis", f"hip_{side}", "free" if root else "ball",
                 f"{{sphere_fit: {{bone: femur_{side}, facing: {hip_bone}}}}}" if hip_bone else hip,
                 [("flexion", "-x"), ("adduction", sign("y", 1)), ("rotation", sign("z", -1))],
                 {"flexion": (-30, 120), "adduction": (-45, 30), "rotation": (-45, 45)}, LIMBS, axes,
                 {"flexion": -angles[0], "adduction": s * angles[1], "rotation": -s * angles[2]},
                 [f"{side.capitalize()}UpLeg", f"{side}UpperLeg"])
    tibia, fibula = bones.vertices(f"{side} tibia"), bones.vertices(f"{side} fibula")
    malleoli = [bone[bone[:, 2] < bone[:, 2].min() + 8].mean(axis=0) for bone in (tibia, fibula)]
    ankle = np.mean(malleoli, axis=0)
    hinge = frame(s * (condyles[1] - condyles[0]), knee - ankle)
    skeleton.add(f"shank_{side}", f"thigh_{side}", f"knee_{side}", "hinge", knee, [("flexion", "x")], {"flexion": (-5, 140)},
                 LIMBS, hinge, None, [f"{side.capitalize()}Leg", f"{side}LowerLeg"])
    if patella:
        skeleton.add(f"patella_{side}", f"thigh_{side}", f"patellofemoral_{side}", "hinge", knee, [("glide", "x")], {}, "", hinge,
                     coupled=[(f"knee_{side}", "flexion", "glide", 0.7)])
    if not foot:
        return
    heads = []
    for n in ("first", "second", "third", "fourth", "fifth"):
        bone = bones.vertices(f"{side} {n} metatarsal bone")
        heads.append(bone[bone[:, 1] < bone[:, 1].min() + 12].mean(axis=0))
    skeleton.add(f"foot_{side}", f"shank_{side}", f"ankle_{side}", "universal", ankle,
                 [("dorsiflexion", "-x"), ("eversion", sign("y", -1))], {"dorsiflexion": (-50, 20), "eversion": (-35, 20)}, LIMBS,
                 frame(s * (malleoli[1] - malleoli[0])), aliases=[f"{side.capitalize()}Foot", f"{side}Foot"])
    skeleton.add(f"toes_{side}", f"foot_{side}", f"toe_joint_{side}", "hinge", np.mean(heads, axis=0), [("extension", "-x")],
                 {"extension": (-40, 65)}, LIMBS, frame(s * (heads[4] - heads[0])),
                 aliases=[f"{side.capitalize()}ToeBase", f"{side}Toes"])


BODYPARTS3D = ["BodyParts3D, (c) The Database Center for Life Science, licensed under CC Attribution-Share Alike 2.1 Japan."]
VISIBLE_HUMAN = ["Visible Human Male: HuBMAP Human Reference Atlas (K. Browne et al.), CC BY 4.0."]


class Case:
    def __init__(self, name, credit, frame):
        self.name, self.skeleton, self.names = name, Skeleton(name), set()
        self.lines = ["# SPDX-License-Identifier: Apache-2.0",
                      "# Written by ../make_cases.py from the data's own tables; use with --data DIR."]
        self.lines += [f"# {line}" for line in credit]
        self.lines += [f"name: {name}", f"frame: {frame}", "unit: mm", "skeleton: skeleton.yaml"]

    def entry(self, name, file, more):
        assert name not in self.names, name
        self.names.add(name)
        self.lines.append(f"  - {{name: {name}, root: data, file: {file}, {more}}}")

    def write(self):
        folder = HERE / self.name
        folder.mkdir(exist_ok=True)
        (folder / "case.yaml").write_text("\n".join(self.lines) + "\n")
        (folder / "skeleton.yaml").write_text("\n".join(self.skeleton.lines) + "\n")


def bodyparts3d(folder):
    case, bones = Case("bodyparts3d", BODYPARTS3D, "LPS"), BodyParts3D(folder)
    pelvis(case.skeleton, bones)
    trunk(case.skeleton, bones)
    for side in ("left", "right"):
        arm(case.skeleton, bones, side)
        leg(case.skeleton, bones, side, f"hip_bone_{side}")
    case.lines += ["skin: {root: data, file: bodyparts3d/derived/body_envelope_DERIVED.stl}", "bones:"]
    for row in bones.rows:
        case.entry(identifier(row["name"]), f"bodyparts3d/{row['file']}", f"segment: {row['segment']}")
    case.lines.append("tissues:")
    for row in csv.DictReader((folder / "muscles.csv").open()):
        case.entry(identifier(row["name"]), f"bodyparts3d/{row['file']}", "group: muscle")
    case.write()


def right_leg(folder):
    """A part of a body: the thigh is cut, and the head of the femur sticks out of the cut."""
    better = {"right femur": "right_leg/FMA24474_right_femur.stl", "right tibia": "right_leg/FMA24477_right_tibia.stl",
              "right fibula": "right_leg/FMA24480_right_fibula.stl", "right patella": "right_leg/FMA24486_right_patella.stl"}
    case, bones = Case("right_leg", BODYPARTS3D, "LPS"), BodyParts3D(folder, better)
    leg(case.skeleton, bones, "right", root=True, patella=True)
    case.lines += ["skin: {root: data, file: bodyparts3d/right_leg/right_leg_skin_closed.stl}", "bones:"]
    for row in bones.rows:
        if row["segment"] in ("thigh_right", "shank_right", "foot_right", "toes_right"):
            segment = "patella_right" if row["name"].lower() == "right patella" else row["segment"]
            case.entry(identifier(row["name"]), f"bodyparts3d/{better.get(row['name'].lower(), row['file'])}", f"segment: {segment}")
    case.lines.append("tissues:")
    case.entry("muscles_right", "bodyparts3d/right_leg/right_leg_muscles_union.ply", "group: muscle")
    case.write()


def visible_human_male(folder):
    """Bones from pelvis to ankle; everything else of the body follows the pelvis and the shanks. Organs in metres."""
    case, bones = Case("visible_human_male", VISIBLE_HUMAN, "LPS"), VisibleHuman(folder)
    pelvis(case.skeleton, bones)
    for side in ("left", "right"):
        leg(case.skeleton, bones, side, foot=False, patella=True)
    case.lines += ["skin: {root: data, file: visible_human_male/skin.stl, frame: LSA}", "bones:"]
    for row in csv.DictReader((folder / "parts.csv").open()):
        if row["segment"] != "skin" and row["file"].startswith("bones/"):
            segment = row["name"] if row["name"].startswith("patella_") else row["segment"]
            case.entry(row["name"], f"visible_human_male/{row['file']}", f"segment: {segment}, frame: LSA")
    case.lines.append("tissues:")
    for organ in ("Heart", "Kidney_L", "Kidney_R", "Liver", "Pancreas", "Spinal_Cord", "Spleen", "Urinary_Bladder"):
        name = re.sub("_r$", "_right", re.sub("_l$", "_left", organ.lower()))
        case.entry(name, f"visible_human_male/glb/VH_M_{organ}.glb", f"group: {'nerve' if organ == 'Spinal_Cord' else 'organ'}")
    case.write()


def main():
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    data = pathlib.Path(sys.argv[1])
    bodyparts3d(data / "bodyparts3d")
    right_leg(data / "bodyparts3d")
    visible_human_male(data / "visible_human_male")


if __name__ == "__main__":
    main()
