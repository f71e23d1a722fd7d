#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Posed CTs and label maps train and test a classifier: other frames of a short walk are labelled far better than all by the commonest label.

It shows that the volumes load with their places and belong together, and nothing beyond: one body, one walk, a classifier of three lines.
"""
import os
import pathlib
import subprocess
import tempfile
import unittest

import nibabel
import numpy as np

ECORCHE = os.environ["ECORCHE_BIN"]
TRAIN, TEST = ("frame_0000", "frame_0016", "frame_0032"), ("frame_0008", "frame_0024", "frame_0040")


def ecorche(*words):
    subprocess.run([ECORCHE, *map(str, words)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=240)


def volumes(frame):
    """(CT, labels, place of each voxel in mm), of the body alone."""
    ct, labels = nibabel.load(frame / "ct.nii.gz"), nibabel.load(frame / "labels.nii.gz")
    np.testing.assert_allclose(ct.affine, labels.affine)
    values, label = np.asarray(ct.dataobj, float), np.asarray(labels.dataobj)
    assert values.shape == label.shape, (values.shape, label.shape)
    place = np.moveaxis(np.indices(label.shape), 0, -1) @ ct.affine[:3, :3].T + ct.affine[:3, 3]
    return values, label, place


def local_mean(values):
    padded = np.pad(values, 1, mode="edge")
    for axis in range(3):
        n = padded.shape[axis]
        padded = sum(padded.take(range(at, n - 2 + at), axis) for at in range(3)) / 3
    return padded


def voxels(folder, frames):
    """(features, labels) of all voxels of the body."""
    rows, names = [], []
    for frame in frames:
        values, label, place = volumes(folder / frame)
        inside = label > 0
        rows.append(np.column_stack([values[inside], local_mean(values)[inside], place[inside]]))
        names.append(label[inside])
    return np.concatenate(rows), np.concatenate(names)


class NaiveBayes:
    """Of Gaussians; a feature varies by its smallest share of the whole at least."""

    def __init__(self, rows, names):
        self.names = np.unique(names)
        of = [rows[names == name] for name in self.names]
        self.mean = np.array([one.mean(0) for one in of])
        self.variance = np.array([one.var(0) for one in of]) + 1e-3 * rows.var(0)
        self.prior = np.log([len(one) / len(rows) for one in of])

    def predict(self, rows):
        score = np.stack([prior - 0.5 * (np.log(variance) + (rows - mean) ** 2 / variance).sum(1)
                          for mean, variance, prior in zip(self.mean, self.variance, self.prior)])
        return self.names[score.argmax(0)]


class Classifier(unittest.TestCase):
    def test_posed_volumes_of_a_walk_train_and_test_one(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            ecorche("phantom", "-o", folder / "case", "--size", "small", "--voxel", "12")
            ecorche("preprocess", folder / "case", "-o", folder / "model.hdf", "--max-tets", "20000")
            ecorche("pose", folder / "model.hdf", "-o", folder / "walk", "--motion", folder / "case/motion/walk.bvh", "--frames", "0:48:8",
                    "--tissues", "none", "--volumes", "ct,labels", "--volume-format", "nii.gz")
            self.assertEqual(sorted(path.name for path in (folder / "walk").glob("frame_*")), sorted(TRAIN + TEST))
            taught, (rows, names) = NaiveBayes(*voxels(folder / "walk", TRAIN)), voxels(folder / "walk", TEST)
        found, counts = taught.predict(rows), np.bincount(names)
        right, commonest = (found == names).mean(), counts.max() / counts.sum()
        labels = np.unique(names)
        alike = np.mean([(found == names)[names == label].mean() for label in labels])  # small labels count as much as large ones
        print(f"{len(names)} voxels of {len(labels)} labels: {right:.3f} right, of all labels alike {alike:.3f}; by the commonest label {commonest:.3f} "
              f"and {1 / len(labels):.3f}")
        self.assertGreater(len(labels), 40)
        self.assertGreater(right, commonest + 0.05)
        self.assertGreater(alike, 1 / len(labels) + 0.4)


if __name__ == "__main__":
    unittest.main(verbosity=2)
