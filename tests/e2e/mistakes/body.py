# SPDX-License-Identifier: Apache-2.0
"""The smallest good case, made without our own writers: every mistake is one change to it."""
import gzip
import pathlib
import struct

CASE = """name: small
frame: LPS
unit: mm
skeleton: skeleton.yaml
skin: skin.stl
bones:
  - {name: pelvis_bone, file: pelvis_bone.stl, segment: pelvis}
  - {name: femur_right, file: femur_right.stl, segment: thigh_right}
tissues:
  - {name: muscle_a, file: muscle_a.stl, group: muscle}
volumes:
  - {name: ct, file: ct.nrrd, background: -1024}
labels: {file: labels.mha, table: {1: pelvis_bone, 2: femur_right}}
"""
SKELETON = """ecorche_skeleton: 1
name: small
segments:
  pelvis:
    joint: {name: root, kind: free, center: [0, 0, 40]}
    aliases: [Hips]
  thigh_right:
    parent: pelvis
    joint:
      name: hip_right
      kind: ball
      center: [0, 0, 15]
      sequence: [{flexion: x}, {adduction: y}, {rotation: z}]
      limits_deg: {flexion: [-20, 120]}
"""
POSE = """ecorche_pose: 1
skeleton: small
root: {translation_mm: [0, 0, 10]}
joints:
  hip_right: {flexion_deg: 30}
"""
BVH = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT thigh_right
  {
    OFFSET 0 -20 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -40 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.0333
0 0 0 0 0 0 0 0 0
0 0 0 0 0 0 0 10 0
0 0 0 0 0 0 0 20 0
"""
CORNERS = [(0, 1, 2), (2, 1, 3), (4, 5, 6), (6, 5, 7), (0, 2, 4), (4, 2, 5), (1, 6, 3), (3, 6, 7), (0, 4, 1), (1, 4, 6),
           (2, 3, 5), (5, 3, 7)]


def box(low, high):
    """The triangles of an outward box, each three points."""
    bits = (0, 2, 1, 3, 4, 5, 6, 7)
    points = [tuple(high[k] if b >> k & 1 else low[k] for k in range(3)) for b in bits]
    return [tuple(points[c] for c in corners) for corners in CORNERS]


def stl(triangles):
    out = b"a box".ljust(80, b" ") + struct.pack("<I", len(triangles))
    for triangle in triangles:
        out += struct.pack("<12fH", 0, 0, 0, *[x for p in triangle for x in p], 0)
    return out


def stl_text(triangles):
    facets = ["facet normal 0 0 0\nouter loop\n" + "".join("vertex %r %r %r\n" % p for p in t) + "endloop\nendfacet\n"
              for t in triangles]
    return "solid a\n" + "".join(facets) + "endsolid a\n"


def nrrd(body, size=(4, 3, 5), kind="int16", encoding="raw", **fields):
    head = {"type": kind, "dimension": 3, "space": "left-posterior-superior",
            "sizes": "%d %d %d" % size, "space directions": "(20,0,0) (0,25,0) (0,0,40)", "kinds": "domain domain domain",
            "endian": "little", "encoding": encoding, "space origin": "(-40,-30,-80)"}
    head.update({key.replace("_", " "): value for key, value in fields.items()})
    lines = [f"{key}: {value}" for key, value in head.items() if value is not None]
    return ("NRRD0004\n" + "\n".join(lines) + "\n\n").encode() + (gzip.compress(body) if encoding == "gzip" else body)


def mha(body, **fields):
    head = {"ObjectType": "Image", "NDims": 3, "BinaryData": "True", "BinaryDataByteOrderMSB": "False",
            "CompressedData": "False", "TransformMatrix": "1 0 0 0 1 0 0 0 1", "Offset": "-40 -30 -80",
            "ElementSpacing": "20 25 40", "DimSize": "4 3 5", "ElementType": "MET_UCHAR", "ElementDataFile": "LOCAL"}
    head.update(fields)
    return "".join(f"{key} = {value}\n" for key, value in head.items() if value is not None).encode() + body


SURFACES = {
    "skin.stl": box((-50, -40, -100), (50, 40, 100)),
    "pelvis_bone.stl": box((-20, -20, 20), (20, 20, 60)),
    "femur_right.stl": box((-10, -10, -80), (10, 10, 10)),
    "muscle_a.stl": box((-10, -30, -80), (10, -12, 10)),
}


def write(folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, triangles in SURFACES.items():
        (folder / name).write_bytes(stl(triangles))
    (folder / "ct.nrrd").write_bytes(nrrd(struct.pack("<60h", *range(60)), encoding="gzip"))
    (folder / "labels.mha").write_bytes(mha(bytes(i % 3 for i in range(60))))
    for name, text in (("case.yaml", CASE), ("skeleton.yaml", SKELETON), ("pose.yaml", POSE), ("clip.bvh", BVH)):
        (folder / name).write_text(text)
    return folder
