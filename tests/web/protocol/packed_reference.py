# SPDX-License-Identifier: Apache-2.0
"""What libecorche_client makes of a tissue: its vertices of 8 bytes, and its floats, of a pose that came as deltas.

usage: packed_reference.py SOURCE ADDRESS TISSUE FOLDER; writes FOLDER/{vertices,positions,normals}, prints low and step as JSON
"""
import ctypes
import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(sys.argv[1]) / "clients" / "python" / "src"))

import ecorche  # noqa: E402
import numpy as np  # noqa: E402


class Packed(ctypes.Structure):
    _fields_ = [("struct_size", ctypes.c_size_t), ("vertex_count", ctypes.c_uint32), ("positions", ctypes.c_void_p), ("normals", ctypes.c_void_p),
                ("low", ctypes.c_double * 3), ("step", ctypes.c_double)]


def call(library, name, *arguments):
    if getattr(library, "ecorche_client_" + name)(*arguments) != 0:
        raise SystemExit(f"{name}: {library.ecorche_client_error_message()}")


def main():
    address, tissue, folder = sys.argv[2], sys.argv[3], pathlib.Path(sys.argv[4])
    with ecorche.connect(address, normals=True) as client:
        for degrees in (10, 60):
            client.show(client.set("elbow_left", flexion=degrees).send())
        row, library, packed = client.tissue(tissue).row, client._library._library, Packed(struct_size=ctypes.sizeof(Packed))
        call(library, "packed", client._handle, row, ctypes.byref(packed))
        vertices = np.zeros((packed.vertex_count, 4), "<u2")
        call(library, "copy_packed", client._handle, row, ctypes.c_void_p(vertices.ctypes.data), ctypes.c_size_t(len(vertices)))
        for name, rows in (("vertices", vertices), ("positions", client.positions(tissue)), ("normals", client.normals(tissue))):
            (folder / name).write_bytes(rows.tobytes())
        print(json.dumps({"low": list(packed.low), "step": packed.step}))


if __name__ == "__main__":
    main()
