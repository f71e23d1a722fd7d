# SPDX-License-Identifier: Apache-2.0
"""Materials by what a tissue is."""
import bpy

# Linear red, green, blue; how much of it is seen through.
GROUPS = {
    "skin": ((0.72, 0.43, 0.31), 0.75),
    "bone": ((0.80, 0.73, 0.57), 0.0),
    "muscle": ((0.42, 0.07, 0.06), 0.0),
    "organ": ((0.45, 0.16, 0.13), 0.0),
    "vessel": ((0.55, 0.03, 0.03), 0.0),
    "nerve": ((0.75, 0.65, 0.20), 0.0),
    "cartilage": ((0.55, 0.68, 0.72), 0.0),
    "ligament": ((0.72, 0.70, 0.62), 0.0),
    "fat": ((0.80, 0.62, 0.25), 0.5),
    "other": ((0.50, 0.50, 0.50), 0.0),
}


def material_of(group: str) -> bpy.types.Material:
    """Of a group of tissues; one for the whole file, which the user may change."""
    name = f"ecorche {group}"
    found = bpy.data.materials.get(name)
    if found is not None:
        return found
    colour, clear = GROUPS.get(group, GROUPS["other"])
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.diffuse_color = (*colour, 1 - clear)
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = 0.5
    shader.inputs["Alpha"].default_value = 1 - clear
    if clear > 0:
        made.blend_method = "BLEND"
        made.show_transparent_back = False
    return made
