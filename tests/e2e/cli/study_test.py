#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""examples/study/evaluate on answers made here: its statistic against one reckoned by hand; files that are no answers."""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

STUDY = pathlib.Path(__file__).resolve().parents[3] / "examples/study"
HEAD = "person,order,pose,view,method,answer\n"


class Evaluate(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def person(self, name, pairs):
        """A file of (pose, fem, cor)."""
        file = self.folder / f"{name}.csv"
        rows = [(pose, method, answer) for pose, *answers in pairs for method, answer in zip(("fem", "cor"), answers)]
        file.write_text(HEAD + "".join(f"{name},{n},{pose},side,{method},{answer}\n" for n, (pose, method, answer) in enumerate(rows, 1)))
        return file

    def evaluate(self, *files, code=0):
        done = subprocess.run([sys.executable, STUDY / "evaluate", *files, "-o", self.folder / "out"], capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        return json.loads(done.stdout) if code == 0 else done.stderr

    def test_five_people_by_hand(self):
        # Mean differences of 0.5, 1, -1.5, 2, 2.5: ranks 1 to 5, the negative one of rank 3, so the lesser sum is 3. Of the 32 ways to give
        # signs five have a sum of at most 3 ({}, 1, 2, 3, 1+2): p = 2 * 5 / 32.
        people = [[(4, 4), (5, 4)], [(5, 4), (5, 4)], [(3, 4), (2, 4)], [(6, 4), (6, 4)], [(7, 4), (6, 4)]]
        found = self.evaluate(*(self.person(f"p{n}", [(pose, *pair) for pose, pair in zip(("knee", "hip"), pairs)]) for n, pairs in enumerate(people)))
        self.assertEqual((found["people"], found["pairs"]), (5, 10))
        self.assertEqual(found["of_people"], {"n": 5, "median": 1.0, "zero": 0, "statistic": 3.0, "p": 0.3125})
        # All pairs: differences 0, 1, 1, 1, -1, -2, 2, 2, 3, 2; without the 0 ranks 2.5 (four of 1), 6.5 (four of 2), 9; negative 2.5 + 6.5.
        self.assertEqual((found["of_pairs"]["n"], found["of_pairs"]["zero"], found["of_pairs"]["statistic"]), (10, 1, 9.0))
        self.assertEqual(found["median_answer"], {"fem": 5.0, "cor": 4.0})
        self.assertTrue((self.folder / "out/answers.png").read_bytes().startswith(b"\x89PNG"))

    def test_equal_answers_say_nothing(self):
        found = self.evaluate(self.person("p", [("knee", 4, 4)]))
        self.assertEqual(found["of_people"], {"n": 1, "median": 0.0, "zero": 1, "statistic": None, "p": None})

    def test_what_is_no_answer_is_refused(self):
        good = self.person("p", [("knee", 4, 5)])
        self.assertIn("person p answered this picture twice (give each person's file once)", self.evaluate(good, good, code=1))
        bad = self.folder / "bad.csv"
        for text, said in (("a,b\n1,2\n", "not a file of answers (its first line must be person,order,"), (HEAD, "no answers (give the files that the page saved)"),
                           (HEAD + "q,1,knee,side,fem,9\n", "bad.csv:2: method 'fem', answer '9' (a method is fem or cor, an answer 1 to 8)"),
                           (HEAD + "q,1,knee,side,fem,8\n", "error: q: knee from side was answered by one method only (leave out files")):
            bad.write_text(text)
            self.assertIn(said, self.evaluate(bad, code=1))


if __name__ == "__main__":
    unittest.main()
