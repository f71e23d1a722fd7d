#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche refill`, `tears`, `deformers` and `pose --deformer spheres`: the way through, and each mistake with its code and words."""
import gzip
import os
import pathlib
import re
import sys
import unittest

import numpy as np

from bar_skeletons import ARM, BarTest, run, write_nrrd

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "mistakes"))
import body  # noqa: E402

CASE = pathlib.Path(os.environ["ECORCHE_CASE"])


class Refill(BarTest):
    def test_every_voxel_kept_fills_the_object_again(self):
        out = self.folder / "rest.nrrd"
        result = self.ok("refill", self.all, self.bar, "-o", out, "--sampling", "nearest", "--object", self.bar)
        self.assertTrue((self.read(out)[0] == self.voxels).all())
        self.assertEqual(result["loss"]["loss_percent"], 0)
        self.assertEqual(result["frames"][0]["held_voxels"], int((self.voxels > 0).sum()))
        thin = self.folder / "thin.vtp"
        self.ok("thin", self.all, "-o", thin, "--tp", 0.7)
        self.assertGreater(self.ok("refill", thin, "-o", out, "--object", self.bar)["loss"]["loss_percent"], 0)
        self.assertLessEqual(set(np.unique(self.read(out)[0])), {0, 1})  # without a volume, a mask

    def test_a_pose_a_region_and_the_way_back(self):
        whole, part, back = (self.folder / name for name in ("whole.nrrd", "part.nrrd", "back.nrrd"))
        words = ("--rig", self.rig, "--pose", self.pose, "--sampling", "nearest")
        self.ok("refill", self.all, self.bar, "-o", whole, *words)
        self.ok("refill", self.all, self.bar, "-o", part, *words, "--region", "20,3,2,45,30,12")
        big, _, big_at = self.read(whole)
        small, _, small_at = self.read(part)
        x, y, z = np.rint(small_at - big_at).astype(int)
        self.assertTrue((big[z:z + small.shape[0], y:y + small.shape[1], x:x + small.shape[2]] == small).all())
        self.assertGreater((small > 0).mean(), 0.2)
        # 60 voxels long before; bent, it reaches as far aside.
        self.assertGreater(big.shape[1], self.voxels.shape[1] + 10)
        self.ok("refill", self.all, whole, "-o", back, *words, "--back")
        again, _, at = self.read(back)
        x, y, z = np.rint(-at).astype(int)
        again = again[z:z + 16, y:y + 17, x:x + 64]
        differ = (again != self.voxels)[self.voxels > 0].mean()
        self.assertLess(differ, 0.12)
        self.assertGreater(differ, 0)

    def test_bridges_fill_what_opens(self):
        out = self.folder / "bridge.nrrd"
        words = ("--rig", self.rig, "--pose", self.pose)
        plain = self.ok("refill", self.few, "-o", out, *words, "--no-bridge")["frames"][0]
        open_ = self.read(out)[0] > 0
        bridged = self.ok("refill", self.few, "-o", out, *words)["frames"][0]
        self.assertGreater(bridged["balls"], plain["balls"])
        self.assertGreater(bridged["held_voxels"], plain["held_voxels"])
        self.assertLess(bridged["held_voxels"], 1.2 * plain["held_voxels"])
        self.assertEqual(int(open_.sum()), plain["held_voxels"])
        self.assertEqual(self.ok("tears", self.few, *words)["frames"][0]["links"], 0)
        # Where nothing is posed there is nothing to bridge.
        still = self.ok("refill", self.few, "-o", out, "--bridge")["frames"][0]
        self.assertEqual(still["held_voxels"], self.ok("refill", self.few, "-o", out, "--no-bridge")["frames"][0]["held_voxels"])

    def test_ways_and_meetings(self):
        table = self.folder / "way.csv"
        way = self.ok("path", self.few, "--from", "3,8,8", "--to", "60,8,8", "-o", table)
        self.assertGreater(way["length_mm"], 40)
        self.assertLess(way["length_mm"], 80)
        rows = np.loadtxt(table, delimiter=",", skiprows=1)
        self.assertEqual(rows.shape, (len(way["points"]), 4))
        self.assertLess(abs(rows[len(rows) // 2, 1] - 8), 4)  # within, of a bar from 2 to 15
        self.assertEqual(rows[:, 3].min(), way["narrowest_mm"])
        bent = self.ok("path", self.few, "--from", "3,8,8", "--to", "60,8,8", "--rig", self.rig, "--pose", self.pose)
        self.assertGreater(np.ptp([p[1] for p in bent["points"]]), 10)
        here = self.ok("contact", self.few, self.few)
        self.assertTrue(here["meet"])
        self.assertGreater(here["depth_mm"], 5)
        far = self.folder / "far.yaml"
        far.write_text(self.pose.read_text() + "root: {translation_mm: [0, 200, 0]}\n")
        away = self.ok("contact", self.few, self.few, "--other-rig", self.rig, "--other-pose", far)
        self.assertFalse(away["meet"])
        self.assertIn("do not meet", run("contact", self.few, self.few, "--other-rig", self.rig, "--other-pose", far).stdout)
        self.assertIn("meet, deepest by", run("contact", self.few, self.few, "--rig", self.rig, "--pose", self.pose).stdout)
        self.assert_error(65, ("path", self.loose, "--from", "3,8,8", "--to", "60,8,8"), "it has no tree")
        self.assert_error(64, ("path", self.few, "--from", "3,8,8", "--to", "60,8,8", "--pose", self.pose), "--rig", "a pose needs a rig (add --rig SKELETON.yaml or MODEL.hdf)")
        self.assert_error(64, ("contact", self.few, self.few, "--pose", self.pose), "--rig")
        self.assert_error(64, ("path", self.few, "--from", "3,8"), "--from")

    def test_effects_and_previews(self):
        out = self.folder / "effect.nrrd"
        held = [self.ok("refill", self.few, "-o", out, "--melt", "--time", t)["frames"][0]["held_voxels"] for t in (0, 0.7, 1)]
        self.assertTrue(held[0] > held[1] > held[2] == 0, held)
        words = ("--rig", self.rig, "--pose", self.pose)
        words += ("--no-bridge",)  # which has balls of its own
        plain = self.ok("refill", self.few, "-o", out, *words)["frames"][0]["held_voxels"]
        self.assertGreater(self.ok("refill", self.few, "-o", out, *words, "--bulge", 0.4)["frames"][0]["held_voxels"], plain)
        self.assertLess(self.ok("refill", self.few, "-o", out, *words, "--bulge", -0.4)["frames"][0]["held_voxels"], plain)
        apart = self.ok("refill", self.few, "-o", out, "--explode", 3)["frames"][0]
        self.assertGreater(apart["size"][0], 100)
        for ending in ("glb", "vtp"):
            preview = self.folder / f"preview.{ending}"
            self.assertGreater(self.ok("refill", self.few, "-o", preview)["frames"][0]["triangles"], 500)
            self.assertGreater(preview.stat().st_size, 1000)

    def test_a_morph_begins_and_ends_with_its_objects(self):
        other = np.zeros((30, 20, 20), np.uint8)
        other[3:27, 3:17, 3:17] = 9
        image, skeleton, out = write_nrrd(self.folder / "other.nrrd", other), self.folder / "other.vtp", self.folder / "morph.nrrd"
        self.assertEqual(run("thin", image, "-o", skeleton, "--tp", -2).returncode, 0)
        words = ("refill", self.all, self.bar, "-o", out, "--morph", skeleton, image, "--sampling", "nearest", "--time")
        self.ok(*words, 0)
        self.assertTrue((self.read(out)[0] == self.voxels).all())
        self.ok(*words, 1)
        last = self.read(out)[0]
        self.assertEqual(int((last == 9).sum()), int((other == 9).sum()))
        self.ok(*words, 0.5)
        half = self.read(out)[0]
        self.assertGreater((half > 0).sum(), min((self.voxels > 0).sum(), (other > 0).sum()) / 2)

    def test_tears_are_told(self):
        result = self.ok("tears", self.few, "--rig", self.rig, "--pose", self.pose, "--prove", 20, "--sweep", "--step", 60)
        self.assertGreaterEqual(result["proof"]["found_percent"], 95)
        self.assertFalse(result["proof"]["rest_errs"])
        self.assertEqual(len(result["frames"]), 1)
        self.assertEqual({row["joint"] for row in result["sweep"]}, {"elbow"})
        self.assertEqual(len(result["sweep"]), 6)
        for row in result["sweep"]:
            self.assertTrue(row["bulged_breaks_at_deg"] == 0 or row["bulged_breaks_at_deg"] >= row["breaks_at_deg"] > 0, row)
            self.assertTrue(row["bridged_breaks_at_deg"] == 0 or row["bridged_breaks_at_deg"] >= row["breaks_at_deg"], row)
        said = run("tears", self.few, "--rig", self.rig, "--sweep", "--step", 90).stdout
        self.assertRegex(said, r"elbow +flexion +\+ +breaks at +(90|180|whole) deg, bulged +\w+, bridged +\w+")

    def test_both_deformers_pose_a_model(self):
        model = self.folder / "m.hdf"
        done = run("preprocess", CASE, "-o", model, "--mesher", "lattice", "--max-tets", 60000, "--spheres", 0.3)
        self.assertEqual(done.returncode, 0, done.stderr)
        pose = self.folder / "knee.yaml"
        info = self.ok("info", model)
        pose.write_text(f"ecorche_pose: 1\nskeleton: {info['skeleton']}\njoints:\n  knee_right: {{flexion_deg: 40}}\n")
        result = self.ok("deformers", model, "--volume", "labels", "--pose", pose, "-o", self.folder / "both")["frames"][0]
        self.assertGreater(result["object_voxels"], 10000)
        self.assertEqual(result["differ"], result["differ_inner"] + result["differ_boundary"])
        self.assertLess(result["differ"], 0.5 * result["object_voxels"])
        colours = self.read(self.folder / "both/difference.nrrd")[0]
        self.assertEqual(int((colours >= 2).sum()), result["differ"])
        self.assertEqual(int((colours == 3).sum()), result["differ_inner"])
        # What `deformers` compares is what `pose` writes.
        self.ok("pose", model, "-o", self.folder / "posed", "--pose", pose, "--volumes", "labels", "--deformer", "spheres")
        own, _, own_at = self.read(self.folder / "posed/labels.nrrd")
        joined, spacing, at = self.read(self.folder / "both/spheres.nrrd")
        x, y, z = np.rint((own_at - at) / spacing).astype(int)
        self.assertTrue((joined[z:z + own.shape[0], y:y + own.shape[1], x:x + own.shape[2]] == own).all())
        mask = self.read(self.folder / "posed/labels-mask.nrrd")[0]
        self.assertEqual(int((own[mask == 0] != 0).sum()), 0)
        self.assertGreater(float((own[mask == 1] != 0).mean()), 0.9)
        both = self.ok("deformers", model, "--volume", "labels", "--pose", pose, "--no-bridge", "-o", self.folder / "both")["frames"][0]
        self.assertNotEqual(both["differ"], result["differ"])
        self.ok("pose", model, "-o", self.folder / "posed", "--pose", pose, "--volumes", "labels", "--deformer", "spheres", "--no-bridge")
        own, _, own_at = self.read(self.folder / "posed/labels.nrrd")
        joined, spacing, at = self.read(self.folder / "both/spheres.nrrd")
        x, y, z = np.rint((own_at - at) / spacing).astype(int)
        self.assertTrue((joined[z:z + own.shape[0], y:y + own.shape[1], x:x + own.shape[2]] == own).all())
        self.assert_error(64, ("pose", model, "-o", self.folder / "p", "--pose", pose, "--no-bridge"), "tets open no gaps")
        self.assert_error(64, ("deformers", model, "--volume", "mri", "--pose", pose), "mri")
        small = body.write(self.folder / "small")
        flat = self.folder / "flat.hdf"
        self.ok("preprocess", small, "-o", flat, "--mesher", "lattice", "--max-tets", 5000, "--spheres", 0.3)
        self.assert_error(64, ("deformers", flat, "--volume", "ct", "--pose", small / "pose.yaml"),
                          "its voxels are not cubic, so the two do not pose it on one lattice (resample it)")
        far = self.folder / "far.yaml"
        far.write_text(f"ecorche_pose: 1\nskeleton: {info['skeleton']}\nroot: {{translation_mm: [1e300, 0, 0]}}\n")
        self.assert_error(65, ("deformers", model, "--volume", "labels", "--pose", far), "(mend the motion)")
        (small / "far.yaml").write_text("ecorche_pose: 1\nskeleton: small\nroot: {translation_mm: [1e300, 0, 0]}\n")
        self.assert_error(65, ("pose", flat, "-o", self.folder / "p", "--pose", small / "far.yaml"), "(mend the motion)")
        self.assert_error(65, ("preprocess", small, "-o", self.folder / "thin.hdf", "--mesher", "lattice", "--max-tets", 5000, "--spheres", 2),
                          "--spheres: no voxel is left at this thinness (choose a lower one)")
        self.assert_error(64, ("pose", model, "-o", self.folder / "p", "--pose", pose, "--deformer", "spheres", "--as-case"), "--deformer")
        plain = pathlib.Path(os.environ["ECORCHE_MODEL"])
        self.assert_error(78, ("pose", plain, "-o", self.folder / "p", "--pose", pose, "--deformer", "spheres"), "holds no spheres")
        self.assert_error(78, ("refill", plain, "-o", self.folder / "x.nrrd"), "holds no spheres")

    def test_mistakes(self):
        out = self.folder / "x.nrrd"
        self.assert_error(64, ("refill", self.few, self.bar, "-o", out, "--pose", self.pose), "--rig: a pose needs a rig (add --rig SKELETON.yaml or MODEL.hdf)")
        fitted = self.folder / "fitted.yaml"
        fitted.write_text(ARM.replace("[30, 8, 7.5]", "{sphere_fit: {bone: a, facing: b}}"))
        self.assert_error(78, ("refill", self.few, self.bar, "-o", out, "--rig", fitted, "--pose", self.pose),
                          "joint 'elbow' is to be fitted to bones (name a model, whose rig is fitted)")
        self.assert_error(64, ("refill", self.few, self.bar, "-o", out, "--region", "0,0,0,5000,5000,5000"), "it holds more than 2^31 voxels (make it smaller)")
        arrays = re.compile(rb'<DataArray ([^>]*Name="(?:Points|ijk|distance|deficit)")[^>]*/>')
        empty = self.folder / "empty.vtp"
        text = re.sub(rb'NumberOfPoints="\d+"', b'NumberOfPoints="0"', self.loose.read_bytes())
        empty.write_bytes(arrays.sub(rb'<DataArray \1 NumberOfComponents="3" format="ascii"></DataArray>', text))
        self.assert_error(65, ("refill", empty, "-o", out), "it has no voxel (thin at a lower TP)")
        alone = self.folder / "alone.yaml"
        alone.write_text("ecorche_skeleton: 1\nname: arm\nsegments:\n  upper: {joint: {name: shoulder, kind: free, center: [6, 8, 7.5]}}\n")
        whole = self.folder / "whole.vtp"
        self.assertEqual(run("thin", self.bar, "-o", whole, "--tp", 0.3, "--tree", "--skeleton", alone).returncode, 0)
        self.assert_error(64, ("tears", whole, "--rig", alone, "--prove", 3), "--prove: no joint lies within the body (check the rig)")
        self.assert_error(64, ("refill", self.few, self.bar, "-o", out, "--rig", self.rig), "nothing is posed")
        self.assert_error(64, ("refill", self.few, self.bar, "-o", out, "--bulge", 1), "--bulge: joints are needed (add --rig and --pose)")
        self.assert_error(64, ("refill", self.few, self.bar, "-o", out, "--back"), "--back: no pose to come back from (add --rig and --pose)")
        self.assert_error(64, ("refill", self.few, self.bar, "-o", self.folder / "x.glb"), "--output: a preview shows no values (leave out VOLUME")
        self.assert_error(64, ("refill", self.few, self.bar, "-o", out, "--region", "9,9,9,1,1,1"), "its low corner is not the low one (give X0,Y0,Z0,X1,Y1,Z1)")
        self.assert_error(64, ("refill", self.few, self.bar, "-o", out, "--region", "9.2,9.2,9.2,9.4,9.4,9.4"), "voxel centre")
        self.assert_error(64, ("refill", self.few, "-o", out, "--morph", self.few, self.bar), "two objects at rest become each other (give VOLUME, and neither a pose")
        self.assert_error(64, ("refill", self.few, self.bar, "-o", out, "--time", 2), "time")
        self.assert_error(65, ("refill", self.loose, self.bar, "-o", out, "--rig", self.rig, "--pose", self.pose), "no segments")
        self.assert_error(66, ("refill", self.folder / "none.vtp", self.bar, "-o", out), "none.vtp")
        other = self.folder / "other.yaml"
        other.write_text(ARM.replace("lower:", "forearm:"))
        self.assert_error(78, ("refill", self.few, self.bar, "-o", out, "--rig", other, "--pose", self.pose), "no segment 'lower'")
        fewer = write_nrrd(self.folder / "fewer.nrrd", np.zeros((4, 4, 4), np.uint8))
        self.assert_error(65, ("refill", self.few, "-o", out, "--object", fewer), "balls hold")
        self.assert_error(64, ("tears", self.few, "--rig", self.rig), "nothing is to be looked at")
        self.assert_error(64, ("tears", self.few, "--sweep"), "--rig: a rig must move the skeleton (add --rig SKELETON.yaml or MODEL.hdf)")
        self.assertFalse(out.exists())

    def test_odd_masks_fill_again(self):
        empty = np.zeros((10, 10, 10), np.uint8)
        sheet, line, one, two = (empty.copy() for _ in range(4))
        sheet[5, 2:8, 2:8] = line[5, 5, 2:8] = one[5, 5, 5] = two[1:4, 1:4, 1:4] = two[6:9, 6:9, 6:9] = 1
        skeleton, out = self.folder / "odd.vtp", self.folder / "odd.nrrd"
        for name, mask in (("all", empty + 1), ("flat", np.ones((1, 30, 30), np.uint8)), ("sheet", sheet), ("line", line), ("one", one), ("two", two)):
            image = write_nrrd(self.folder / f"{name}.nrrd", mask)
            made = self.ok("thin", image, "-o", skeleton, "--tp", -2, "--tree")
            self.assertEqual((made["skeletal"], made["voxels"]["pieces"]), (int(mask.sum()), 2 if name == "two" else 1), name)
            done = self.ok("refill", skeleton, image, "-o", out, "--object", image, "--sampling", "nearest")
            self.assertTrue((self.read(out)[0] == mask).all(), name)
            self.assertEqual(done["loss"]["loss_percent"], 0, name)
        self.assert_error(65, ("thin", write_nrrd(self.folder / "empty.nrrd", empty), "-o", skeleton), "no voxel is of the object")
        self.assert_error(65, ("thin", write_nrrd(self.folder / "long.nrrd", np.ones((1, 1, 66000), np.uint8)), "-o", skeleton), "more than 65535 voxels along an axis")
        huge = write_nrrd(self.folder / "huge.nrrd", empty)
        huge.write_bytes(huge.read_bytes().replace(b"sizes: 10 10 10", b"sizes: 99999 99999 99999"))
        self.assert_error(65, ("thin", huge, "-o", skeleton), "declares 99999 x 99999 x 99999 voxels")

    def test_colours_stay_with_their_voxels(self):
        rgb = np.zeros((20, 20, 20, 3), np.uint8)
        rgb[4:16, 4:16, 4:16] = (200, 100, 50)
        rgb[8:12, 8:12, 8:12] = (10, 250, 30)
        image, skeleton, out = self.folder / "rgb.nrrd", self.folder / "rgb.vtp", self.folder / "rgb_again.nrrd"
        image.write_bytes(b"NRRD0004\ntype: uint8\ndimension: 4\nspace: left-posterior-superior\nsizes: 3 20 20 20\n"
                          b"space directions: none (1,0,0) (0,1,0) (0,0,1)\nkinds: RGB-color domain domain domain\nencoding: raw\n"
                          b"space origin: (0,0,0)\n\n" + rgb.tobytes())
        self.ok("thin", image, "-o", skeleton, "--component", 1, "--threshold", "50:", "--tp", -2)
        for sampling in ("nearest", "trilinear"):
            self.ok("refill", skeleton, image, "-o", out, "--sampling", sampling)
            head, data = out.read_bytes().split(b"\n\n", 1)
            self.assertIn(b"sizes: 3 20 20 20", head)
            self.assertEqual(gzip.decompress(data) if b"gzip" in head else data, rgb.tobytes())
        self.assert_error(64, ("thin", image, "-o", skeleton, "--component", 5, "--threshold", "50:"), "--component", "3 component(s)")



if __name__ == "__main__":
    unittest.main()
