# SPDX-License-Identifier: Apache-2.0
"""Poses prepared patients, in process or by a server, as numpy arrays.

    import ecorche

    model = ecorche.Model("patient.hdf")
    body = model.pose("lib:sitting", elbow_left={"flexion": 90})    # degrees
    body.positions("skin")                                         # (V, 3) float32, LPS mm
    body.measure().passes

    with ecorche.connect("127.0.0.1:7070") as client:               # the same by `ecorche serve`
        client.set("elbow_left", flexion=90)
        client.show(client.send())
        client.positions("skin")

Millimetres and LPS axes throughout (x to the left, y to the back, z up); angles are degrees, as in pose files. Errors are Error and its
subclasses; their text says what is wrong, where, and how to mend it.
"""
import pkgutil

# The protocol's messages, ecorche.v1, may lie elsewhere on the path.
__path__ = pkgutil.extend_path(__path__, __name__)

from ._library import Error, InvalidArgument, NotFound, NotPossible, Unavailable, version  # noqa: E402
from .body import Body, Probed, Quality, Reason  # noqa: E402
from .client import Client, Frame, connect  # noqa: E402
from .model import Angle, Grid, Model, Pose, Segment, Tissue, Volume  # noqa: E402
from .spheres import Spheres  # noqa: E402
from .volume_stream import VolumeStream  # noqa: E402

__version__ = version()
__all__ = ["Angle", "Body", "Client", "Error", "Frame", "Grid", "InvalidArgument", "Model", "NotFound", "NotPossible", "Pose", "Probed", "Quality",
           "Reason", "Segment", "Spheres", "Tissue", "Unavailable", "Volume", "VolumeStream", "connect"]
