# SPDX-License-Identifier: Apache-2.0
"""A small picture of a model as it was scanned: skin and bones seen through, a ball at each joint. Run below a display (xvfb-run).

usage: thumbnail.py MODEL OUT.png SURE <JOINTS.json      JOINTS: a list of [centre in mm, confidence]; green where that is SURE or more, else red
"""
import json
import pathlib
import sys

from vtkmodules.vtkFiltersSources import vtkSphereSource

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "scripts/renderer"))
import bodies  # noqa: E402
import scene  # noqa: E402

HEIGHT, BALL = 300, 0.012  # pixels; of the body's longest side
SURE, UNSURE = (0.10, 0.50, 0.25), (0.80, 0.20, 0.15)


def ball(centre, radius, colour):
    source = vtkSphereSource()
    source.SetCenter(*centre)
    source.SetRadius(radius)
    source.Update()
    return scene.surface_actor(source.GetOutput(), colour)


def main(model, path, sure):
    body = bodies.read(pathlib.Path(model))
    actors = [scene.surface_actor(tissue.surface, scene.colour_of(tissue), 0.25 if tissue.group == "skin" else 0.45)
              for tissue in body.tissues if tissue.group in ("skin", "bone")]
    low, high = scene.bounds_of(actors)
    radius = BALL * float((high - low).max())
    actors += [ball(centre, radius, SURE if confidence >= float(sure) else UNSURE) for centre, confidence in json.load(sys.stdin)]
    scene.shoot(actors, "front", HEIGHT, (low, high)).save(pathlib.Path(path))


main(*sys.argv[1:])
