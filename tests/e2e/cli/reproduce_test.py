#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""scripts/reproduce on the small phantom: every part finds rows that can be read, and what must hold of them on any body does.

Parts that take long, or draw, are the class Slow; Data needs the public data sets (ECORCHE_DATA), Benches the programs of -DECORCHE_BENCH=ON.
"""
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]


class Parts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        (cls.folder / "made").mkdir()
        (cls.folder / "made/phantom_small").symlink_to(os.environ["ECORCHE_CASE"])

    def run_parts(self, names, *words, code=0):
        done = subprocess.run([ROOT / "scripts/reproduce", "--size", "small", "--only", names, "--made", self.folder / "made", "-o", self.folder / "page.md", *words],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        return done

    def found(self, name, *words):
        """The rows of a part by where they are of; all of them stand on the page."""
        self.run_parts(name, *(words or ("--no-pictures",)))
        found = json.loads((self.folder / f"made/found_{name}.json").read_text())["found"]
        page = (self.folder / "page.md").read_text()
        for row in found["rows"]:
            self.assertIn(f"| {row['where']} | ", page)
            self.assertTrue(all(row[key] for key in ("theirs", "ours", "command")), row)
            self.assertNotRegex(row["ours"], r"\bnan\b|None")
        for picture in found["pictures"]:
            self.assertIn(f"](pictures/results/{picture['file']})", page)
            self.assertGreater((self.folder / "pictures/results" / picture["file"]).stat().st_size, 3000)
        return {row["where"]: row["ours"] for row in found["rows"]}, found["pictures"]


class Fast(Parts):
    def test_the_three_ways_share_all_vertices(self):
        rows, _ = self.found("mapping")
        within, outside, bones = (int(re.match(r"\d+", text)[0]) for text in rows.values())
        self.assertEqual(within + outside + bones, int(re.search(r"of (\d+)", list(rows.values())[0])[1]))
        self.assertGreater(min(within, outside, bones), 0)

    def test_every_voxel_refills_the_body(self):
        rows, _ = self.found("filling")
        self.assertRegex(rows["5.1: refilled with every voxel as a ball"], r"^0 of \d+ voxels differ")

    def test_bones_lie_within_the_skin_and_the_tets_near_it(self):
        rows, _ = self.found("enclosure")
        self.assertGreater(float(rows["built-in patient: bones within the skin, as scanned"].split(" %")[0]), 99)
        self.assertLess(float(rows["built-in patient: scaffold to skin, chamfer"].split(" mm")[0]), 15.8)

    def test_voxels_hang_on_segments_and_a_bar_stays_whole(self):
        rows, _ = self.found("hanging")
        self.assertRegex(next(iter(rows.values())), r"^\d\d segments .* \d+ voxels by what they see, \d+ along the tree$")
        self.assertIn("stays whole", next(iter(self.found("cylinder")[0].values())))

    def test_parts_that_were_not_run_are_said(self):
        self.run_parts("mapping", "--no-pictures")
        page = (self.folder / "page.md").read_text()
        self.assertIn("Not run: `scripts/reproduce --only bodies --data DIR` does.", page)
        self.assertIn("## Gagvani and Silver 2001", page)
        before = page[page.index("### Mapping tissues to tets (section 3.4)"):page.index("### Tets and weights")]
        (self.folder / "made/found_mapping.json").unlink()
        done = self.run_parts("bodies")
        self.assertIn("bodies: left out, it needs --data", done.stderr)
        self.assertIn(before, (self.folder / "page.md").read_text(), "a part that was not run now stays as it is")

    def test_wrong_words_are_refused(self):
        self.assertIn("--only figure_9: no such part (name some of: ", self.run_parts("figure_9", code=2).stderr)
        self.assertIn("--data /nowhere: no such folder (give the one ", self.run_parts("mapping", "--data", "/nowhere", code=2).stderr)


class Slow(Parts):
    def test_table_1(self):
        rows, _ = self.found("preparing")
        self.assertEqual(sum(where.startswith("table 1: ") for where in rows), 10)

    def test_the_bar_loses_by_lbs_and_gains_by_dqs_about_an_axis_at_its_inside(self):
        rows, pictures = self.found("bar", "--data", str(self.folder))
        lbs, dqs, _ = (float(change) for change in re.findall(r"([+-][\d.]+) %", rows["figure 7: bent by 100 degrees, joints at the inside"]))
        self.assertLess(lbs, 0)
        self.assertGreater(dqs, 0)
        self.assertEqual(len(pictures), 1)

    def test_pictures_of_tets_bodies_and_effects(self):
        for name, count in (("tets", 3), ("shown", 2), ("effects", 1), ("radiographs", 1)):
            with self.subTest(name):
                self.assertEqual(len(self.found(name, "--data", str(self.folder))[1]), count)

    def test_an_elbow_by_finite_elements(self):
        rows, _ = self.found("fem")
        self.assertEqual(len(rows), 2)
        for text in rows.values():
            self.assertRegex(text, r"^CoR is [\d.]+ mm from it .* 0 inverted")

    def test_thinning_is_about_exponential(self):
        rows, _ = self.found("thinning")
        self.assertRegex(rows["figure 5: skeletal voxels against TP"], r"exp\(-\d")
        self.assertRegex(rows["figure 5: loss against TP"], r"exp\(\d")

    def test_the_rest(self):
        for name in ("study", "back", "index", "sweep", "tears"):
            with self.subTest(name):
                self.assertTrue(self.found(name)[0])


@unittest.skipUnless(os.environ.get("ECORCHE_DATA"), "ECORCHE_DATA names no folder of the public data sets")
class Data(Parts):
    def test_a_real_knee(self):
        rows, _ = self.found("bodies_prepared", "--data", os.environ["ECORCHE_DATA"], "--no-pictures")
        self.assertEqual(list(rows), ["knee: certificate, weights, rest pose and rigid bones", "knee: read, checked and prepared in 3 minutes and 8 GiB"])
        rows, _ = self.found("enclosure_real", "--data", os.environ["ECORCHE_DATA"], "--no-pictures")
        self.assertEqual(len(rows), 3)
        self.assertGreater(float(rows["knee: bones within the skin, as scanned"].split(" %")[0]), 90)

    def test_verdicts_of_a_deep_pose(self):
        rows, pictures = self.found("verdicts", "--data", os.environ["ECORCHE_DATA"])
        self.assertEqual(list(rows), ["icrp110_female: sitting"])
        self.assertRegex(rows["icrp110_female: sitting"], r"^skinned: (pass|warn)\b.*; joints alone: (pass|warn)\b.*; corrected: (pass|warn)\b.*; settled: (pass|warn)\b")
        self.assertEqual(len(pictures), 0 if "corrected: pass" in rows["icrp110_female: sitting"] else 1)


class Benches(Parts):
    def test_frames_and_seconds(self):
        for name in ("posing", "thinning_times", "filling_times"):
            with self.subTest(name):
                self.assertTrue(self.found(name)[0])


class Measures(unittest.TestCase):
    """What rows are made of, against answers that are known."""

    @classmethod
    def setUpClass(cls):
        sys.path.insert(0, str(ROOT / "bench"))

    def test_ssim_is_that_of_a_plain_sum(self):
        import numpy as np
        from reproduce import zhang

        rng = np.random.default_rng(7)
        a = rng.random((31, 31))
        b = np.clip(a + 0.1 * rng.standard_normal(a.shape), 0, 1)
        self.assertEqual(zhang.alike(a, a), (1.0, math.inf))
        offsets = np.arange(-5, 6)
        window = np.exp(-(offsets[:, None] ** 2 + offsets[None] ** 2) / (2 * 1.5 ** 2))
        window /= window.sum()
        values = []
        for i in range(5, 26):
            for j in range(5, 26):
                x, y = (one[i - 5:i + 6, j - 5:j + 6] for one in (a, b))
                mx, my = (window * x).sum(), (window * y).sum()
                vx, vy, xy = (window * (x - mx) ** 2).sum(), (window * (y - my) ** 2).sum(), (window * (x - mx) * (y - my)).sum()
                values.append((2 * mx * my + 1e-4) * (2 * xy + 9e-4) / ((mx * mx + my * my + 1e-4) * (vx + vy + 9e-4)))
        self.assertAlmostEqual(zhang.alike(a, b, edge=5)[0], np.mean(values), places=10)
        self.assertAlmostEqual(zhang.alike(np.zeros((9, 9)), np.full((9, 9), 0.1))[1], 20)

    def test_distances_and_inside_of_balls(self):
        import numpy as np
        from vtkmodules.vtkFiltersSources import vtkSphereSource
        from reproduce import surfaces

        balls = []
        for radius in (10, 12):
            source = vtkSphereSource()
            source.SetRadius(radius)
            source.SetThetaResolution(120)
            source.SetPhiResolution(120)
            source.Update()
            balls.append(source.GetOutput())
        for way in surfaces.apart(*balls):
            self.assertAlmostEqual(way, 2, delta=0.02)
        found = surfaces.inside(np.array([[0, 0, 0], [9.9, 0, 0], [10.2, 0, 0], [0, 0, 30]]), balls[0])
        self.assertEqual(found.tolist(), [True, True, False, False])

    def test_printed_tables_are_read(self):
        from reproduce import bodies, gagvani_thin, sujar_pose

        a, b, r2 = gagvani_thin.exponential([(tp / 10, 500 * math.exp(-7 * tp / 10)) for tp in range(1, 9)])
        self.assertAlmostEqual(a, 500, places=6)
        self.assertAlmostEqual(b, -7, places=9)
        self.assertAlmostEqual(r2, 1, places=9)
        bar = sujar_pose.bar_rows(["twist 135 alone        tets %   occupied %       skin %   inverted", "  lbs       -3.10        +2.00        -1.00        7", "[ OK ]"])
        self.assertEqual(bar, {"twist 135 alone": {"lbs": [-3.1, 2.0, -1.0]}})
        walk = "".join(f"| {name} | {threads} | 2.500 | 400 | 4.000 | 250 |\n" for threads in (1, 2) for name in ("lbs", "dqs", "cor"))
        self.assertEqual(sujar_pose.walk_rows(walk)[2].ours, "mean 400 a second (2.50 ms), worst 250 (4.00 ms), 2 threads")
        with self.assertRaisesRegex(SystemExit, "told of lbs .expected lbs, dqs and cor."):
            sujar_pose.walk_rows("| lbs | 1 | 2.500 | 400 | 4.000 | 250 |\n")
        printed = "| body | truth |  | found |\n|--|--|\n| knee | 1 | holds | a, b |\n| knee | 2 | DOES NOT HOLD | 3 % |\n"
        self.assertEqual(bodies.truths(printed), [("knee", 1, True, "a, b"), ("knee", 2, False, "3 %")])


if __name__ == "__main__":
    unittest.main()
