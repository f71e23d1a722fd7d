# SPDX-License-Identifier: Apache-2.0
"""Patients of ecorche in Blender: tissues as meshes, joints as bones (docs/how-to/blender.md)."""
import os
import sys

bl_info = {
    "name": "ecorche",
    "author": "The ecorche authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D Viewport > Sidebar > ecorche",
    "description": "Shows and poses prepared patients. For training and education, not for planning surgery",
    "category": "Import-Export",
}

import bpy  # noqa: E402

# The zip brings the Python package along; an installed one goes first.
sys.path.append(os.path.join(os.path.dirname(__file__), "python"))

from . import bodies, panel  # noqa: E402

follow_frame = bpy.app.handlers.persistent(bodies.follow_frame)


def register() -> None:
    panel.register()
    bpy.app.handlers.frame_change_post.append(follow_frame)
    bpy.app.timers.register(bodies.tick, persistent=True)


def unregister() -> None:
    bpy.app.timers.unregister(bodies.tick)
    bpy.app.handlers.frame_change_post.remove(follow_frame)
    for body in bodies.alive():
        body.close()
    panel.unregister()
