# SPDX-License-Identifier: Apache-2.0
"""Run by Blender for blender_test.py: `within.py -- SCRIPT ARGUMENTS`."""
import math
import os
import sys
import time

import bpy
import numpy as np

ARGUMENTS = sys.argv[sys.argv.index("--") + 1:]

bpy.ops.preferences.addon_install(filepath=os.environ["ADDON_ZIP"])
bpy.ops.preferences.addon_enable(module="ecorche_blender")
for leftover in list(bpy.data.objects):
    bpy.data.objects.remove(leftover)

import ecorche  # noqa: E402  (the add-on's)
from ecorche_blender import bodies, skeleton  # noqa: E402


def vertices(name):
    mesh = bpy.data.objects[name].data
    out = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", out)
    return out.reshape(-1, 3)


def bend(armature, bone, turn):
    """By hand; `turn`: w, x, y, z."""
    armature.pose.bones[bone].rotation_quaternion = turn
    bpy.context.view_layer.update()


def flexed(model, degrees):
    """The turn of the left elbow."""
    x, y, z, w = ecorche.Pose(model).set("elbow_left", flexion=degrees).rotation("elbow_left")
    return w, x, y, z


def local(path):
    model = ecorche.Model(path)
    assert bpy.ops.ecorche.open(filepath=path) == {"FINISHED"}
    (body,) = bodies.alive()
    armature = body.armature
    # A collection a group, an object a tissue, in metres, left at +x.
    assert {collection.name.split()[-1] for collection in body.collection.children} == {tissue.group for tissue in model.tissues}
    assert len(body.meshes) == len(model.tissues)
    assert all(mesh.materials[0].name == f"ecorche {tissue.group}" for mesh, tissue in zip(body.meshes, model.tissues))
    np.testing.assert_allclose(vertices("skin"), model.tissue("skin").rest * 0.001, atol=1e-6)
    assert vertices("hand_bones_left")[:, 0].min() > 0.1
    assert not bpy.data.objects["skin"].data.validate()
    # Bones to body.
    bone = model.segment("elbow_left").name
    bend(armature, bone, flexed(model, 60))
    body.step()
    expected = model.pose(elbow_left={"flexion": 60})
    np.testing.assert_allclose(vertices("skin"), expected.positions("skin") * 0.001, atol=1e-5)
    bone_of = armature.pose.bones["hand_left"]
    centre = expected.motion("hand_left") @ [*model.segment("hand_left").centre, 1]
    np.testing.assert_allclose(bone_of.matrix.translation, centre * 0.001, atol=1e-5)
    # Beyond its limit the body stays, and the bone goes back to it.
    bend(armature, bone, flexed(model, 178))
    assert bpy.ops.ecorche.hold_limits() == {"FINISHED"}
    turned = armature.pose.bones[bone].rotation_quaternion.angle
    assert math.radians(100) < turned < math.radians(172), turned
    # Body to bones: every bone of a posture, and the posture again from the bones.
    assert bpy.ops.ecorche.load(name="lib:sitting") == {"FINISHED"}
    sitting = model.pose("lib:sitting")
    np.testing.assert_allclose(vertices("skin"), sitting.positions("skin") * 0.001, atol=1e-5)
    for segment in model.segments:
        centre = sitting.motion(segment.name) @ [*segment.centre, 1]
        np.testing.assert_allclose(armature.pose.bones[segment.name].matrix.translation, centre * 0.001, atol=1e-5)
    before = vertices("skin")
    body._posed = None
    assert body.follow_bones()
    np.testing.assert_allclose(vertices("skin"), before, atol=2e-5)
    # The root goes.
    armature.pose.bones[model.segments[0].name].location.z += 0.1
    bpy.context.view_layer.update()
    body.step()
    way = (vertices("skin") - before).mean(axis=0)
    assert abs(np.linalg.norm(way) - 0.1) < 1e-4, way
    # An action drives it, frame by frame.
    part = armature.pose.bones[bone]
    for frame, degrees in ((1, 0), (11, 80)):
        part.rotation_quaternion = flexed(model, degrees)
        part.keyframe_insert("rotation_quaternion", frame=frame)
    bpy.context.scene.frame_set(1)
    straight = vertices("skin")
    bpy.context.scene.frame_set(11)
    assert np.abs(vertices("skin") - straight).max() > 0.05
    bpy.context.scene.frame_set(1)
    np.testing.assert_allclose(vertices("skin"), straight, atol=1e-5)
    # A probe, and what is refused.
    bpy.context.scene.cursor.location = vertices("pelvis").mean(axis=0)
    assert bpy.ops.ecorche.probe() == {"FINISHED"}
    assert "scanned at" in bpy.context.scene.ecorche_probed, bpy.context.scene.ecorche_probed
    bpy.context.scene.cursor.location = (50, 0, 0)
    bpy.ops.ecorche.probe()
    assert bpy.context.scene.ecorche_probed == "outside the body"
    for wrong, text in ((lambda: bpy.ops.ecorche.open(filepath="/nowhere.hdf"), "/nowhere.hdf"), (lambda: bpy.ops.ecorche.load(name="lib:flying"), "flying")):
        try:
            wrong()
        except RuntimeError as error:
            assert text in str(error), error
        else:
            raise AssertionError(text)
    bpy.data.objects.remove(armature)
    assert bodies.alive() == []


def until(body, done, seconds=20):
    end = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < end
        body.step()
        time.sleep(0.01)


def served(address):
    assert bpy.ops.ecorche.connect(address=address, session="ward") == {"FINISHED"}
    (body,) = bodies.alive()
    armature = body.armature
    assert body.source.leads
    rest = vertices("skin")
    # Bones to server, and so to others.
    with ecorche.connect(address, session="ward") as other:
        part = armature.pose.bones["forearm_left"]
        bend(armature, "forearm_left", flexed(ecorche.Model(os.environ["ECORCHE_MODEL"]), 60))
        until(body, lambda: np.abs(vertices("skin") - rest).max() > 0.05)
        turned = part.rotation_quaternion.copy()
        until(body, lambda: any(True for _ in other.frames()))
        list(other.frames(0.5))
        np.testing.assert_allclose(vertices("skin"), other.positions("skin") * 0.001, atol=2e-4)
        assert part.rotation_quaternion == turned, "what is ours is not turned back"
    # Others to bones: a clip of the server.
    clip = "walk"
    thigh = armature.pose.bones["thigh_left"].rotation_quaternion.copy()
    assert bpy.ops.ecorche.play(clip=clip) == {"FINISHED"}
    until(body, lambda: armature.pose.bones["thigh_left"].rotation_quaternion.rotation_difference(thigh).angle > 0.1)
    bpy.ops.ecorche.play(clip="")
    middle = vertices("femur_left").mean(axis=0)
    tail = armature.pose.bones["thigh_left"].matrix.translation
    assert np.linalg.norm(middle - np.array(tail)) < 0.4
    try:
        bpy.ops.ecorche.connect(address="127.0.0.1:1")
    except RuntimeError as error:
        assert "cannot be reached" in str(error)
    else:
        raise AssertionError("nobody is there")


def picture(path, out):
    bpy.ops.ecorche.open(filepath=path)
    bpy.ops.ecorche.load(name="lib:sitting")
    scene = bpy.context.scene
    skin = vertices("skin")
    middle = skin.mean(axis=0)
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.9, 0.92, 0.95, 1)
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 2.5, (math.radians(50), 0, math.radians(35))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 1.15 * float(np.ptp(skin, axis=0).max())
    for one in (sun, camera):
        scene.collection.objects.link(one)
    aim = bpy.data.objects.new("aim", None)
    aim.location = middle
    scene.collection.objects.link(aim)
    camera.location = middle + [2.2, -2.6, 0.9]
    look = camera.constraints.new("TRACK_TO")
    look.target = aim
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = "CPU", 16, False
    scene.cycles.transparent_max_bounces = 16
    scene.render.resolution_x, scene.render.resolution_y = 480, 600
    scene.render.film_transparent = False
    scene.render.filepath = out
    bpy.ops.render.render(write_still=True)
    shown = bpy.data.images.load(out)
    pixels = np.array(shown.pixels[:]).reshape(600, 480, 4)[..., :3]
    body = np.abs(pixels - pixels[0, 0]).max(axis=2) > 0.08
    assert 0.1 < body.mean() < 0.8, body.mean()
    assert pixels[body].std(axis=0).min() > 0.02


{"local": local, "served": served, "picture": picture}[ARGUMENTS[0]](*ARGUMENTS[1:])
print(f"{ARGUMENTS[0]}: all well")
