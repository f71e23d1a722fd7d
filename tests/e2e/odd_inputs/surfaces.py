# SPDX-License-Identifier: Apache-2.0
"""Odd surfaces: a leg of two bones in a skin, with one thing wrong. Each row: its name, its files, and what must come of it."""
import numpy as np

import shapes
from outcome import Prepared, Refused

SKELETON = """ecorche_skeleton: 1
name: leg
segments:
  thigh:
    joint: {name: root, kind: free, center: [0, 0, 300]}
  shank:
    parent: thigh
    joint:
      name: knee
      kind: hinge
      center: [0, 0, 0]
      sequence: [{flexion: x}]
      limits_deg: {flexion: [-10, 140]}
"""
POSE = "ecorche_pose: 1\nskeleton: leg\njoints:\n  knee: {flexion_deg: 30}\n"

SKIN = shapes.capsule(-300, 300, 50)
THIGH, SHANK = shapes.capsule(25, 270, 14), shapes.capsule(-270, -25, 14)
PLAIN = {"skin": SKIN, "thigh_bone": THIGH, "shank_bone": SHANK}


def leg(more=(), unit="mm", segments=None, **surfaces):
    """The files of a case; a surface that is None is left out of the list, `more` are bones beside: (name, segment, triangles)."""
    all_of_them = {**PLAIN, **surfaces}
    bones = [(name, name.split("_")[0]) for name in ("thigh_bone", "shank_bone") if all_of_them[name] is not None]
    for name, segment, triangles in more:
        all_of_them[name] = triangles
        bones.append((name, segment))
    lines = "".join(f"  - {{name: {name}, file: {name}.stl, segment: {segment}}}\n" for name, segment in bones)
    skin = "skin: skin.stl\n" if all_of_them["skin"] is not None else ""
    files = {f"{name}.stl": triangles if isinstance(triangles, bytes) else shapes.stl(triangles) for name, triangles in all_of_them.items()
             if triangles is not None}
    files["case.yaml"] = f"name: leg\nunit: {unit}\nskeleton: skeleton.yaml\n{skin}bones:\n{lines}"
    files["skeleton.yaml"] = SKELETON
    return files


def pieces(count, low, high):
    """A bone as hundreds of grains."""
    random = np.random.default_rng(3)
    at = np.stack([random.uniform(-9, 9, count), random.uniform(-9, 9, count), random.uniform(low, high, count)], 1)
    return np.concatenate([shapes.box(p - 3, p + 3) for p in at])


def many_bones():
    """Two hundred bones in sixty segments of a stick, without a skeleton."""
    files = {"skin.stl": shapes.stl(shapes.capsule(-620, 620, 40, rings=80))}
    lines = ""
    for i in range(200):
        segment, z = i * 60 // 200, -600 + 6 * i
        name = f"bone_{i}"
        files[f"{name}.stl"] = shapes.stl(shapes.moved(shapes.box((-9, -9, 0), (9, 9, 4.5)), (0, 0, z)))
        lines += f"  - {{name: {name}, file: {name}.stl, segment: part_{segment}}}\n"
    files["case.yaml"] = f"name: many\nskeleton: generic\nskin: skin.stl\nbones:\n{lines}"
    return files


def top_off(triangles, above):
    return triangles[triangles[:, :, 2].max(1) <= above]


HOLED = shapes.without(SKIN, 0.02)
FAR = shapes.joined(SKIN, shapes.moved(shapes.box((0, 0, 0), (8, 8, 8)), (0, 0, 900)))
TWO = shapes.joined(SKIN, shapes.moved(SKIN, (300, 0, 0)))
SHELLS = shapes.joined(SKIN, shapes.turned_over(shapes.capsule(-297, 297, 47)))
SHELLS_OUT = shapes.joined(SKIN, shapes.capsule(-297, 297, 47))
CROSSED = shapes.joined(shapes.capsule(-300, 40, 50), shapes.capsule(-40, 300, 50))
INSIDE_THIGH = shapes.capsule(120, 180, 6)

OPEN = "the surface is open"
ROWS = [
    ("plain", leg(), Prepared("pass")),
    ("skin_open_at_the_top", leg(skin=top_off(SKIN, 290)), Refused(65, OPEN, mended=True)),
    ("skin_open_at_both_ends", leg(skin=shapes.capsule(-300, 300, 50, caps=False)), Refused(65, OPEN, mended=True)),
    ("skin_full_of_holes", leg(skin=HOLED), Refused(65, OPEN, mended=True)),
    ("skin_half_gone", leg(skin=SKIN[SKIN[:, :, 0].max(1) <= 1]), Refused(65, "skin: is open: it has 1 hole of")),
    ("skin_double_shelled", leg(skin=SHELLS), Refused(65, "skin: is a shell: a part of it is turned inward", mended=True)),
    ("skin_double_shelled_outward", leg(skin=SHELLS_OUT), Prepared("pass")),
    ("skin_of_two_that_cross", leg(skin=CROSSED), Prepared("pass")),
    ("skin_that_cuts_itself", leg(skin=shapes.jittered(SKIN, 6)), Prepared()),
    ("skin_inside_out", leg(skin=shapes.turned_over(SKIN)), Prepared("pass")),
    ("skin_partly_turned_over", leg(skin=shapes.some_turned_over(SKIN, 0.2)), Prepared("pass", ("open edges",))),
    ("skin_twice", leg(skin=shapes.joined(SKIN, SKIN)), Prepared("pass")),
    ("skin_as_soup", leg(skin=shapes.apart(SKIN, 0.02)), Refused(65, "skin: is open: it has")),
    ("skin_not_named", leg(skin=None), Refused(78, "lacks the key 'skin'")),
    ("skin_without_triangles", leg(skin=shapes.stl(SKIN[:0])), Refused(65, "skin.stl: has no triangle")),
    ("skin_a_sheet", leg(skin=shapes.box((-50, -50, -350), (50, 50, 350))[:2]), Refused(65, "skin: ")),
    ("skin_of_no_area", leg(skin=np.repeat(SKIN[:, :1], 3, 1)), Refused(65, "skin: encloses no volume")),
    ("skin_in_metres", leg(skin=SKIN / 1000), Refused(65, "skin: is 0.7 mm long, the bones 568 mm (mend its unit: made 1000 times larger it would be 700 mm)")),
    ("meshes_in_metres", leg(unit="m", skin=SKIN / 1000, thigh_bone=THIGH / 1000, shank_bone=SHANK / 1000),
     Refused(65, "made 1000 times smaller it would lie at its bones")),
    ("skin_with_a_far_speck", leg(skin=FAR), Prepared(said=("touches no bone",))),
    ("skin_of_two_bodies", leg(skin=TWO), Prepared(said=("touches no bone",))),
    ("bones_nested", leg(more=[("inner", "shank", INSIDE_THIGH)]), Prepared("warn")),
    ("bones_nested_in_one_segment", leg(more=[("inner", "thigh", INSIDE_THIGH)]), Prepared("pass")),
    ("bones_overlapping", leg(thigh_bone=shapes.capsule(-20, 270, 14), shank_bone=shapes.capsule(-270, 20, 14)), Prepared("warn")),
    ("bones_touching", leg(thigh_bone=shapes.capsule(14, 270, 14), shank_bone=shapes.capsule(-270, -14, 14)), Prepared()),
    ("bone_through_the_skin", leg(shank_bone=shapes.capsule(-500, -25, 14)), Prepared(said=("shank_bone: ", "% of it lies outside the skin"))),
    ("bone_outside_of_the_skin", leg(shank_bone=shapes.moved(SHANK, (200, 0, 0))), Refused(65, "shank: its bones lie outside the skin")),
    ("bone_in_hundreds_of_pieces", leg(shank_bone=pieces(300, -270, -25)), Prepared("pass")),
    ("bone_open", leg(shank_bone=shapes.capsule(-270, -25, 14, caps=False)), Prepared(said=("shank_bone: the surface is open",))),
    ("bone_inside_out", leg(shank_bone=shapes.turned_over(SHANK)), Prepared("pass")),
    ("bone_thinner_than_a_tet", leg(more=[("plate", "shank", shapes.box((-0.1, -20, -200), (0.1, 20, -100)))]), Prepared("pass")),
    ("bone_missing", leg(shank_bone=None), Prepared(said=("segment shank has no bone in this case",), pose=None)),
    ("bone_twice_in_two_segments", leg(more=[("again", "thigh", SHANK)]), Prepared(said=("bone 'again' has no tet",))),
    ("bone_larger_than_the_skin", leg(thigh_bone=shapes.moved(SKIN, scale=1.5)), Prepared("warn", ("% of it lies outside the skin",))),
    ("bone_is_the_skin", leg(thigh_bone=SKIN), Prepared("warn")),
    ("bone_a_single_triangle", leg(shank_bone=SHANK[:1]), Prepared(said=("encloses nothing",))),
    ("two_hundred_bones_in_sixty_segments", many_bones(), Prepared(pose=None)),
]

# Of the public data sets: file, and what comes of it as a skin of a metre with one bone in its middle.
SHAPES = [
    ("beetle.obj", Refused(65, OPEN, mended=True)),
    ("truck.obj", Refused(65, OPEN)),
    ("cow.off", Prepared(pose=None)),
    ("suzanne.obj", Prepared(said=("open edges",), pose=None)),
    ("teapot.obj", Refused(65, OPEN, mended=True)),
    ("stanford-bunny.obj", Refused(65, OPEN, mended=True)),
    ("spot.obj", Prepared(pose=None)),
    ("homer.obj", Prepared(pose=None)),
    ("cheburashka.obj", Prepared(pose=None)),
    ("octopus-low.mesh", Refused(65, "'.mesh' surfaces cannot be read")),
]


def shape(path):
    """The files of a case with this skin; a bone in the middle of its vertices."""
    lines = [line.split() for line in path.read_text().splitlines()]
    if path.suffix == ".obj":
        lines = [line[1:4] for line in lines if line and line[0] == "v"]
    else:  # an .off, a .mesh: numbers of which some have a point
        lines = [line[:3] for line in lines if len(line) in (3, 4) and "." in line[0] + line[1]]
    points = np.array(lines, float)
    extent = np.ptp(points, 0).max()
    bone = shapes.moved(shapes.capsule(-1, 1, 0.5), points.mean(0), 0.03 * extent)
    return {path.name: path.read_bytes(), "bone.stl": shapes.stl(bone),
            "case.yaml": f"name: shape\nunit: {1000 / extent:.9g}\nskeleton: generic\nskin: {path.name}\nbones:\n  - {{name: bone, file: bone.stl}}\n"}


def shape_rows(data):
    return [(name.replace(".", "_"), shape(data / "odd_shapes" / name), expected) for name, expected in SHAPES]
