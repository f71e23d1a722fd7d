# SPDX-License-Identifier: Apache-2.0
"""What the user presses: a panel in the viewport's sidebar, and its operators."""
import os
from typing import Optional

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ImportHelper

import ecorche

from . import bodies
from .skeleton import METRES
from .sources import Local, Served


def chosen(context: bpy.types.Context) -> Optional[bodies.SceneBody]:
    """The body whose armature is active; the only one where there is one."""
    known = {body.armature.name: body for body in bodies.alive()}
    active = context.active_object
    if active is not None and active.name in known:
        return known[active.name]
    return next(iter(known.values())) if len(known) == 1 else None


class OfBody:
    """An operator on a body; what ecorche refuses is reported."""

    @classmethod
    def poll(cls, context):
        return chosen(context) is not None

    def execute(self, context):
        try:
            self.work(context, chosen(context))
        except ecorche.Error as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class Open(OfBody, bpy.types.Operator, ImportHelper):
    """Opens a prepared body (.hdf), posed in this process"""
    bl_idname, bl_label, bl_options = "ecorche.open", "Open model", {"UNDO"}
    filename_ext = ".hdf"
    filter_glob: StringProperty(default="*.hdf", options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        return True

    def work(self, context, _):
        bodies.SceneBody(Local(self.filepath), os.path.splitext(os.path.basename(self.filepath))[0])


class Connect(OfBody, bpy.types.Operator):
    """Shows a body that ecorche serve poses"""
    bl_idname, bl_label, bl_options = "ecorche.connect", "Connect", {"UNDO"}
    address: StringProperty(name="Address", default="127.0.0.1:7070")
    model: StringProperty(name="Model", description="Empty: the server's first")
    session: StringProperty(name="Session", description="To be shared with others by its name; empty: one of its own")
    token: StringProperty(name="Token", subtype="PASSWORD", options={"SKIP_SAVE"})
    authorities: StringProperty(name="Certificates", description="A PEM file; empty: no TLS", subtype="FILE_PATH")

    @classmethod
    def poll(cls, context):
        return True

    def invoke(self, context, event):
        return context.window_manager.invoke_props_dialog(self)

    def work(self, context, _):
        source = Served(self.address, self.model or None, self.session or None, self.token or None, self.authorities or None)
        bodies.SceneBody(source, self.session or self.model or "patient")


class Load(OfBody, bpy.types.Operator):
    """Poses as a pose file, or lib:NAME, says; in this process only"""
    bl_idname, bl_label, bl_options = "ecorche.load", "Pose", {"UNDO"}
    name: StringProperty(name="Pose", default="lib:sitting")

    @classmethod
    def poll(cls, context):
        body = chosen(context)
        return body is not None and isinstance(body.source, Local)

    def invoke(self, context, event):
        return context.window_manager.invoke_props_dialog(self)

    def work(self, context, body):
        body.source.load(self.name)
        body.show()
        body.follow_source()


class HoldLimits(OfBody, bpy.types.Operator):
    """Turns bones back to where their joints' limits and couplings let the body go"""
    bl_idname, bl_label, bl_options = "ecorche.hold_limits", "Hold limits", {"UNDO"}

    def work(self, context, body):
        body.hold_limits()


class Play(OfBody, bpy.types.Operator):
    """Plays a clip that the server holds; no name: stops"""
    bl_idname, bl_label = "ecorche.play", "Play clip"
    clip: StringProperty(name="Clip")

    @classmethod
    def poll(cls, context):
        body = chosen(context)
        return body is not None and isinstance(body.source, Served)

    def work(self, context, body):
        body.source.play(self.clip or None)


class Probe(OfBody, bpy.types.Operator):
    """Says what is at the 3D cursor, and where that was in the scan"""
    bl_idname, bl_label = "ecorche.probe", "Probe at cursor"

    def work(self, context, body):
        at = body.armature.matrix_world.inverted() @ context.scene.cursor.location
        scan, tissue = body.source.probe([value / METRES for value in at])
        place = "outside the body" if scan[0] != scan[0] else f"{tissue or 'soft tissue'}, scanned at {', '.join(f'{value:.1f}' for value in scan)} mm"
        context.scene.ecorche_probed = place
        self.report({"INFO"}, place)


class Panel(bpy.types.Panel):
    bl_idname, bl_label, bl_category = "VIEW3D_PT_ecorche", "ecorche", "ecorche"
    bl_space_type, bl_region_type = "VIEW_3D", "UI"

    def draw(self, context):
        row = self.layout.row()
        row.operator(Open.bl_idname)
        row.operator(Connect.bl_idname)
        body = chosen(context)
        if body is None:
            self.layout.label(text="Choose a body's armature" if bodies.BODIES else "No body is open")
            return
        self.layout.label(text=f"{body.armature.name}: {len(body.meshes)} tissues")
        if isinstance(body.source, Local):
            self.layout.operator(Load.bl_idname)
        for clip, seconds in body.source.clips.items():
            self.layout.operator(Play.bl_idname, text=f"{clip} ({seconds:.1f} s)").clip = clip
        if body.source.clips:
            self.layout.operator(Play.bl_idname, text="Stop").clip = ""
        self.layout.operator(HoldLimits.bl_idname)
        self.layout.operator(Probe.bl_idname)
        if context.scene.ecorche_probed:
            self.layout.label(text=context.scene.ecorche_probed)


CLASSES = (Open, Connect, Load, HoldLimits, Play, Probe, Panel)


def register() -> None:
    bpy.types.Scene.ecorche_probed = StringProperty()
    for one in CLASSES:
        bpy.utils.register_class(one)


def unregister() -> None:
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
    del bpy.types.Scene.ecorche_probed
