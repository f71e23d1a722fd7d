# SPDX-License-Identifier: Apache-2.0
"""Bodies in the scene: meshes by groups, an armature, and what keeps them and their source alike."""
from typing import Optional, Union

import bpy
import numpy as np

from . import looks, skeleton
from .sources import Local, Served

BODIES: dict[str, "SceneBody"] = {}  # by the name of the armature


class SceneBody:
    """A collection with one collection for each group of tissues, a mesh for each tissue, and the armature."""

    def __init__(self, source: Union[Local, Served], name: str) -> None:
        self.source, self.anatomy = source, source.anatomy
        self.collection = bpy.data.collections.new(name)
        bpy.context.scene.collection.children.link(self.collection)
        self.armature = skeleton.make_armature(self.anatomy, name, self.collection)
        self.meshes = self._make_meshes()
        self._posed: Optional[tuple] = None  # what the bones were when the source was last told
        BODIES[self.armature.name] = self
        self.show()
        self.follow_source()

    def _make_meshes(self) -> list[bpy.types.Mesh]:
        groups: dict[str, bpy.types.Collection] = {}
        out = []
        for tissue in self.anatomy.tissues:
            if tissue.group not in groups:
                groups[tissue.group] = bpy.data.collections.new(f"{self.collection.name} {tissue.group}")
                self.collection.children.link(groups[tissue.group])
            mesh = bpy.data.meshes.new(tissue.name)
            corners, count = tissue.triangles.astype(np.int32), len(tissue.triangles)
            mesh.vertices.add(len(tissue.rest))
            mesh.loops.add(3 * count)
            mesh.polygons.add(count)
            mesh.loops.foreach_set("vertex_index", corners.ravel())
            mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
            mesh.polygons.foreach_set("loop_total", np.full(count, 3, np.int32))
            mesh.polygons.foreach_set("use_smooth", np.ones(count, bool))
            mesh.materials.append(looks.material_of(tissue.group))
            groups[tissue.group].objects.link(bpy.data.objects.new(tissue.name, mesh))
            mesh.update(calc_edges=True)
            out.append(mesh)
        return out

    def show(self) -> None:
        """The source's vertices into the meshes."""
        for tissue, mesh in zip(self.anatomy.tissues, self.meshes):
            points = self.source.positions(tissue.row) * np.float32(skeleton.METRES)
            mesh.vertices.foreach_set("co", points.ravel())
            mesh.update()

    def follow_source(self) -> None:
        """The bones as the body is: posed by others, by a clip, or held by limits."""
        skeleton.write_bones(self.armature, self.anatomy, self.source.motions())
        bpy.context.view_layer.update()
        self._posed = skeleton.read_bones(self.armature, self.anatomy)

    def follow_bones(self, wait: bool = False) -> bool:
        """The body as the bones are, where they changed and this side poses it."""
        if not self.source.leads:
            return False
        bones = skeleton.read_bones(self.armature, self.anatomy)
        if not skeleton.differ(bones, self._posed):
            return False
        self._posed = bones
        if isinstance(self.source, Served):
            self.source.set(*bones, wait=wait)
            if not wait:
                return True
        else:
            self.source.set(*bones)
        self.show()
        return True

    def step(self) -> None:
        """What a timer does: frames in, bones out; and where others pose, bones in."""
        turned = self.follow_bones()
        came, others = self.source.take()
        if came:
            self.show()
        if others and not turned:
            self.follow_source()

    def hold_limits(self) -> None:
        """Bones that were turned further than their joints can go back to where the body is."""
        self.follow_bones(wait=True)
        self.follow_source()

    def close(self) -> None:
        """The source ends; what it posed last stays in the scene."""
        self.source.close()
        BODIES.pop(self.armature.name, None)


def alive() -> list[SceneBody]:
    """Without those whose armature was deleted."""
    for name, body in list(BODIES.items()):
        if bpy.data.objects.get(name) is None:
            body.source.close()
            del BODIES[name]
    return list(BODIES.values())


def tick() -> float:
    """Of Blender's timer; seconds until the next."""
    for body in alive():
        body.step()
    return 1 / 30


def follow_frame(scene: bpy.types.Scene, *_: object) -> None:
    """Of Blender's handler: a frame of an animation shows its own pose, in a render too."""
    for body in alive():
        if scene.objects.get(body.armature.name) is not None:
            body.follow_bones(wait=True)
