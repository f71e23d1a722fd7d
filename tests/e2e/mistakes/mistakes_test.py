#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every mistake of table.py by the real command: its exit code, one error line that says what and how to mend, no result,
nothing left behind, and never longer than a minute."""
import concurrent.futures
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import body
import table

ECORCHE = os.environ["ECORCHE_BIN"]
ERROR_LINE = re.compile(r"^error: .+: .+ \(.+\)$", re.M)


def run(words, **options):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=60, errors="replace", **options)


class Mistakes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.good = body.write(cls.folder / "good")
        cls.model = cls.folder / "good.hdf"
        made = run(("preprocess", cls.good, "-o", cls.model, "--mesher", "lattice", "--max-tets", "5000"))
        assert made.returncode == 0, made.stderr

    def words(self, row, case, out):
        name = {"CASE": str(case), "OUT": str(out), "MODEL": str(self.model)}
        return [re.sub(r"^(CASE|OUT|MODEL)(?=/|$)", lambda m: name[m.group(1)], word) for word in row]

    def wrong(self, row):
        """What of a row does not hold, or nothing."""
        name, change, words, code, part = row
        folder = self.folder / name
        case = folder / "case"
        shutil.copytree(self.good, case)
        out = folder / "out"
        out.mkdir()
        change(case)
        before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
        try:
            result = run(self.words(words, case, out))
        except subprocess.TimeoutExpired:
            return f"{name}: hangs"
        problems = []
        if result.returncode != code:
            problems.append(f"exit code {result.returncode}, not {code}")
        if part is not None:  # None: the report itself is the answer
            lines = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
            if len(lines) != 1 or not ERROR_LINE.match(lines[0]) or part not in lines[0]:
                problems.append(f"not one error line with {part!r}")
            if result.stdout:
                problems.append("a result beside the error")
        after = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
        if after != before:
            problems.append(f"files changed: {sorted(str(p) for p in set(before) ^ set(after))}")
        shutil.rmtree(folder)
        return f"{name}: {'; '.join(problems)}\n    {result.stderr[-400:]}" if problems else None

    def test_every_mistake(self):
        names = [row[0] for row in table.ROWS]
        self.assertEqual(len(names), len(set(names)), "each row has its own name")
        self.assertGreaterEqual(len(names), 60)
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            wrong = [problem for problem in pool.map(self.wrong, table.ROWS) if problem]
        self.assertEqual(wrong, [], f"\n{len(wrong)} of {len(names)} rows:\n" + "\n".join(wrong))

    def test_what_repair_mends(self):
        """Two lids off, a triangle turned over, one twice: check names them, repair mends them, and the rest goes along."""
        case, out = body.write(self.folder / "broken"), self.folder / "mended"
        skin = list(body.SURFACES["skin.stl"])
        bone = list(body.SURFACES["femur_right.stl"])
        (case / "skin.stl").write_bytes(body.stl(skin[1:]))
        (case / "femur_right.stl").write_bytes(body.stl([bone[0][::-1], *bone[1:], bone[5]]))
        before = {p.name: p.read_bytes() for p in case.iterdir()}
        found = json.loads(run(("--json", "check", case)).stdout)
        surfaces = {surface["name"]: surface for surface in found["surfaces"]}
        self.assertEqual(surfaces["skin"]["holes"][0]["edges"], 3)
        self.assertEqual(surfaces["femur_right"]["flipped_triangles"]["count"], 1)
        self.assertEqual(surfaces["femur_right"]["duplicate_triangles"]["count"], 1)
        self.assertEqual(json.loads(run(("--json", "repair", case, "-o", out, "--dry-run")).stdout)["written"], False)
        self.assertFalse(out.exists())
        done = json.loads(run(("--json", "repair", case, "-o", out, "--holes", "500")).stdout)
        lines = {line["name"]: line for line in done["surfaces"]}
        self.assertEqual((lines["skin"]["holes_filled"], lines["skin"]["filling_triangles"]), (1, 1))
        self.assertEqual((lines["femur_right"]["triangles_turned"], lines["femur_right"]["duplicates_dropped"]), (1, 1))
        self.assertEqual((lines["muscle_a"]["changed"], lines["skin"]["open_edges_left"]), (False, 0))
        self.assertEqual(before, {p.name: p.read_bytes() for p in case.iterdir()}, "the input stays as it was")
        again = json.loads(run(("--json", "check", out)).stdout)
        self.assertEqual([f for f in again["findings"] if f["severity"] != "note"], [])
        self.assertEqual(len(again["surfaces"]), 4)
        made = run(("preprocess", out, "-o", self.folder / "mended.hdf", "--mesher", "lattice", "--max-tets", "5000"))
        self.assertEqual(made.returncode, 0, made.stderr)
        self.assertIn("labels", run(("info", self.folder / "mended.hdf")).stdout + made.stdout)

    def test_the_good_case_is_good(self):
        """Or else every row above would prove nothing."""
        check = run(("check", self.good))
        self.assertEqual(check.returncode, 0, check.stderr)
        for words, name in ((table.POSE, "posed"), (table.MOVE, "moved")):
            self.assertEqual(run(self.words(words, self.good, self.folder / name)).returncode, 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
