# SPDX-License-Identifier: Apache-2.0
"""An armature with a bone for each segment. A bone rests in its joint's axes, at its centre: then Blender's own rotation of the bone is the
turn that ecorche has, and its motion down the tree is the same. Blender's axes are ecorche's: x to the left, y to the back, z up, in metres."""
from typing import Mapping

import bpy
import numpy as np
from mathutils import Matrix, Vector

METRES = 0.001


def make_armature(anatomy, name: str, collection: bpy.types.Collection) -> bpy.types.Object:
    """At rest as scanned. `anatomy`: ecorche.Model or Client."""
    made = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    made.show_in_front = True
    made.data.display_type = "STICK"
    collection.objects.link(made)
    bpy.context.view_layer.objects.active = made
    bpy.ops.object.mode_set(mode="EDIT")
    lengths = bone_lengths(anatomy)
    for segment in anatomy.segments:
        bone = made.data.edit_bones.new(segment.name)
        bone.length = lengths[segment.name]
        bone.matrix = rest_matrix(segment)
        if segment.parent is not None:
            bone.parent = made.data.edit_bones[segment.parent]
    bpy.ops.object.mode_set(mode="OBJECT")
    for bone in made.pose.bones:
        bone.rotation_mode = "QUATERNION"
        # Joints hold; the root alone goes.
        bone.lock_location = (bone.parent is not None,) * 3
        bone.lock_scale = (True,) * 3
    return made


def rest_matrix(segment) -> Matrix:
    """Of its bone, in the armature's space."""
    out = Matrix([[float(value) for value in row] for row in segment.axes]).to_4x4()
    out.translation = Vector([float(value) for value in segment.centre]) * METRES
    return out


def bone_lengths(anatomy) -> dict[str, float]:
    """Half way to the nearest child, metres; 5 cm where there is none."""
    out = {}
    for segment in anatomy.segments:
        ways = [float(np.linalg.norm(child.centre - segment.centre)) for child in anatomy.segments if child.parent == segment.name]
        out[segment.name] = max(min(ways, default=100.0) / 2, 10.0) * METRES
    return out


def read_bones(armature: bpy.types.Object, anatomy) -> tuple[dict[str, tuple[float, ...]], tuple[float, ...]]:
    """The turns of all joints (x, y, z, w), and where the root goes (LPS mm), as the bones stand: by hand, by an action, by constraints."""
    turns, root = {}, (0.0, 0.0, 0.0)
    for segment in anatomy.segments:
        bone = armature.pose.bones[segment.name]
        rest = bone.bone.matrix_local
        parent = bone.parent
        # As it is seen, whatever made it so.
        local = rest.inverted() @ bone.matrix if parent is None else \
            (parent.bone.matrix_local.inverted() @ rest).inverted() @ parent.matrix.inverted() @ bone.matrix
        turn = local.to_quaternion().normalized()
        turns[segment.name] = (turn.x, turn.y, turn.z, turn.w)
        if parent is None:
            root = tuple((rest.to_3x3() @ local.translation) / METRES)
    return turns, root


def write_bones(armature: bpy.types.Object, anatomy, motions: Mapping[str, np.ndarray]) -> None:
    """Turns the bones as the segments are, (3, 4) each, LPS mm; one that is not told moves as its parent."""
    moved = {None: Matrix()}
    for segment in anatomy.segments:
        before = moved[segment.parent]
        moved[segment.name] = matrix_of(motions[segment.name]) if segment.name in motions else before
        bone = armature.pose.bones[segment.name]
        rest = bone.bone.matrix_local
        basis = rest.inverted() @ before.inverted() @ moved[segment.name] @ rest
        turn = basis.to_quaternion()
        turn.make_compatible(bone.rotation_quaternion)
        bone.rotation_quaternion = turn
        if segment.parent is None:
            bone.location = basis.translation


def matrix_of(motion: np.ndarray) -> Matrix:
    """A motion of ecorche, in Blender's metres."""
    out = Matrix([[float(value) for value in row[:3]] for row in motion]).to_4x4()
    out.translation = Vector([float(row[3]) for row in motion]) * METRES
    return out


def differ(one, other) -> bool:
    """Whether two results of read_bones are more than Blender's float32 apart."""
    if one is None or other is None:
        return True
    turned = any(abs(sum(p * q for p, q in zip(one[0][name], other[0][name]))) < 1 - 1e-9 for name in one[0])  # q and -q turn alike
    return turned or any(abs(p - q) > 1e-3 for p, q in zip(one[1], other[1]))
