# SPDX-License-Identifier: Apache-2.0
"""Run inside Blender by bench_runtime: its armature on the points of a body, time of a frame with and without "preserve volume"."""
import sys
import time

import bpy
import mathutils
import numpy as np

with open(sys.argv[sys.argv.index("--") + 1], "rb") as file:
    points, rows, segments, frames = np.fromfile(file, np.uint32, 4)
    at = np.fromfile(file, np.float32, 3 * points)
    begin = np.fromfile(file, np.uint32, points + 1)
    weight = np.fromfile(file, np.float32, rows)
    motions = np.fromfile(file, np.float64, 7 * frames * segments).reshape(frames, segments, 7)
    segment = np.fromfile(file, np.uint16, rows)

mesh = bpy.data.meshes.new("body")
mesh.vertices.add(points)
mesh.vertices.foreach_set("co", at)
body = bpy.data.objects.new("body", mesh)
armature = bpy.data.objects.new("rig", bpy.data.armatures.new("rig"))
for thing in (body, armature):
    bpy.context.scene.collection.objects.link(thing)
bpy.context.view_layer.objects.active = armature
bpy.ops.object.mode_set(mode="EDIT")
for s in range(segments):
    bone = armature.data.edit_bones.new(str(s))
    bone.head, bone.tail = (0, 0, 0), (0, 1, 0)  # along y: its own matrix is the identity
bpy.ops.object.mode_set(mode="OBJECT")
for s in range(segments):
    body.vertex_groups.new(name=str(s))
of_point = np.repeat(np.arange(points), np.diff(begin))
for s in range(segments):
    group, mine = body.vertex_groups[s], segment == s
    for p, w in zip(of_point[mine].tolist(), weight[mine].tolist()):
        group.add((p,), w, "REPLACE")
modifier = body.modifiers.new("rig", "ARMATURE")
modifier.object = armature

for volume in (False, True):
    modifier.use_deform_preserve_volume = volume
    took = []
    for f in range(-2, frames):
        for s, (w, x, y, z, *shift) in enumerate(motions[f]):
            armature.pose.bones[s].matrix = mathutils.Matrix.Translation(shift) @ mathutils.Quaternion((w, x, y, z)).to_matrix().to_4x4()
        start = time.perf_counter()
        bpy.context.view_layer.update()
        if f >= 0:
            took.append(1000 * (time.perf_counter() - start))
    posed = np.empty(3 * points, np.float32)
    body.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices.foreach_get("co", posed)
    took.sort()
    print(f"  Blender {bpy.app.version_string} armature, {'dual quaternions' if volume else 'LBS'}: all its threads "
          f"{took[len(took) // 2]:.3f} ms ({took[0]:.3f} .. {took[-1]:.3f}); the first point ends at "
          + " ".join(f"{x:.2f}" for x in posed[:3]), flush=True)
