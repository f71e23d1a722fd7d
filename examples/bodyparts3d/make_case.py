#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Writes case.yaml and skeleton.yaml of the BodyParts3D body beside itself, from the data's own tables and bones.

usage: make_case.py DATA     (the folder that holds bodyparts3d/; needs python3-vtk9 and python3-numpy)

Joint centres: hips and shoulders are sphere fits of `ecorche preprocess`; the others are measured here, as each rule says.
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


class Bones:
    def __init__(self, folder):
        self.folder = folder
        self.rows = list(csv.DictReader((folder / "bones.csv").open()))
        self.by_name = {row["name"].lower(): row for row in self.rows}

    def vertices(self, name):
        reader = vtkSTLReader()
        reader.SetFileName(str(self.folder / self.by_name[name.lower()]["file"]))
        reader.Update()
        return vtk_to_numpy(reader.GetOutput().GetPoints().GetData()).astype(float)


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
    def __init__(self):
        self.lines = ["ecorche_skeleton: 1", "name: bodyparts3d", "segments:"]

    def add(self, segment, parent, joint, kind, center, sequence, limits, source, axes=None, rest=None, aliases=()):
        self.lines.append(f"  {segment}:")
        if parent:
            self.lines.append(f"    parent: {parent}")
        self.lines += ["    joint:", f"      name: {joint}", f"      kind: {kind}"]
        self.lines.append(f"      center: {center if isinstance(center, str) else text(center)}")
        if axes is not None:
            self.lines.append(f"      axes: {{x: {text(axes[:, 0])}, z: {text(axes[:, 2])}}}")
        self.lines.append("      sequence: [" + ", ".join(f"{{{name}: {axis}}}" for name, axis in sequence) + "]")
        if rest:
            self.lines.append("      rest_deg: {" + ", ".join(f"{k}: {v:.1f}" for k, v in rest.items()) + "}")
        if limits:
            bounds = ", ".join(f"{k}: [{a}, {b}]" for k, (a, b) in limits.items())
            self.lines.append(f'      limits_deg: {{{bounds}, source: "{source}"}}')
        if aliases:
            self.lines.append("    aliases: [" + ", ".join(aliases) + "]")


def trunk(skeleton, bones):
    middle = lambda name: bones.vertices(name).mean(axis=0)  # noqa: E731
    bend = [("flexion", "x"), ("lateral_bending", "y"), ("rotation", "z")]
    hips = [sphere(head(bones, side)) for side in ("left", "right")]
    skeleton.add("pelvis", None, "pelvis", "free", np.mean(hips, axis=0), [("tilt", "x"), ("obliquity", "y"), ("rotation", "z")],
                 {}, "", aliases=["Hips", "hips"])
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


def leg(skeleton, bones, side):
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
    skeleton.add(f"thigh_{side}", "pelvis", f"hip_{side}", "ball",
                 f"{{sphere_fit: {{bone: femur_{side}, facing: hip_bone_{side}}}}}",
                 [("flexion", "-x"), ("adduction", sign("y", 1)), ("rotation", sign("z", -1))],
                 {"flexion": (-30, 120), "adduction": (-45, 30), "rotation": (-45, 45)}, LIMBS, axes,
                 {"flexion": -angles[0], "adduction": s * angles[1], "rotation": -s * angles[2]},
                 [f"{side.capitalize()}UpLeg", f"{side}UpperLeg"])
    tibia, fibula = bones.vertices(f"{side} tibia"), bones.vertices(f"{side} fibula")
    malleoli = [bone[bone[:, 2] < bone[:, 2].min() + 8].mean(axis=0) for bone in (tibia, fibula)]
    ankle = np.mean(malleoli, axis=0)
    skeleton.add(f"shank_{side}", f"thigh_{side}", f"knee_{side}", "hinge", knee, [("flexion", "x")], {"flexion": (-5, 140)},
                 LIMBS, frame(s * (condyles[1] - condyles[0]), knee - ankle), None,
                 [f"{side.capitalize()}Leg", f"{side}LowerLeg"])
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


def write_case(folder, bones):
    lines = ["# Written by make_case.py from bones.csv and muscles.csv: BodyParts3D, (c) The Database Center for Life Science,",
             "# licensed under CC Attribution-Share Alike 2.1 Japan. Use with --data DIR.", "name: bodyparts3d", "frame: LPS", "unit: mm",
             "skeleton: skeleton.yaml", "skin: {root: data, file: bodyparts3d/derived/body_envelope_DERIVED.stl}", "bones:"]
    names = set()

    def unique(name):
        assert name not in names, name
        names.add(name)
        return name

    for row in bones.rows:
        lines.append(f"  - {{name: {unique(identifier(row['name']))}, root: data, file: bodyparts3d/{row['file']}, "
                     f"segment: {row['segment']}}}")
    lines.append("tissues:")
    for row in csv.DictReader((folder / "muscles.csv").open()):
        lines.append(f"  - {{name: {unique(identifier(row['name']))}, root: data, file: bodyparts3d/{row['file']}, group: muscle}}")
    (HERE / "case.yaml").write_text("\n".join(lines) + "\n")


def main():
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    folder = pathlib.Path(sys.argv[1]) / "bodyparts3d"
    bones = Bones(folder)
    skeleton = Skeleton()
    trunk(skeleton, bones)
    for side in ("left", "right"):
        arm(skeleton, bones, side)
        leg(skeleton, bones, side)
    (HERE / "skeleton.yaml").write_text("\n".join(skeleton.lines) + "\n")
    write_case(folder, bones)


if __name__ == "__main__":
    main()
