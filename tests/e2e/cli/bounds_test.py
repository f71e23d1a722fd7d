#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How bench/all reads what benches print, and judges it: by benches that print what the test says; no time is measured."""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BENCH = pathlib.Path(__file__).resolve().parents[3] / "bench"
sys.path.insert(0, str(BENCH))
from printed import Printed  # noqa: E402

TABLES = """
- a note | that is no table

| what            | threads | median ms | floor ms |
|-----------------|--------:|----------:|---------:|
| frame           |       1 |     4.000 |          |
| frame           |       2 |     2.500 |    1.250 |
| frame, normals  |       2 |     3.000 |    2.000 |

| load a \\| b     | p50 ms | got         |
|-----------------|-------:|------------:|
| a \\| b          |   0.25 | 11.3 x      |
| frame           |  -1.50 | not allowed |
"""
BOUNDS = '''
import sys
from real_bounds import *
ONE, TWO, GONE = Source("tiny 2.5", 1), Source("tiny --ozz OZZ", 1, "ozz"), Source("tiny broken", 1)
take = at("frame", "median ms")
BOUNDS = [Bound("is met", ONE, take, 2.5, "ms", floor=take, of="ms: itself"), Bound("is missed", ONE, take, 2.4, "ms"),
          Bound("enough", ONE, take, 2.5, "a second", least=True), Bound("too few", ONE, take, 2.6, "a second", least=True),
          Bound("of a peer", TWO, take, 1, "x"), Bound("of a bench that fails", GONE, take, 1, "x"),
          Bound("of a row that is not there", ONE, at("nothing", "median ms"), 1, "x"),
          Bound("out of reach", ONE, take, 2.4, "ms", limit=take, isolates="no work at all"),
          Bound("within reach", ONE, take, 2.4, "ms", limit=lambda printed: 2.3, isolates="some of the work")]
'''
TINY = '''#!/usr/bin/python3
import sys
if sys.argv[1] == "broken":
    sys.exit("error: tiny: broken")
print("| what | median ms |\\n|---|--:|\\n| frame | " + sys.argv[1] + " |")
'''


class Reading(unittest.TestCase):
    def setUp(self):
        self.printed = Printed(TABLES)

    def test_by_row_and_column(self):
        self.assertEqual(self.printed.number("frame", "median", exactly=True, threads=1), 4)
        self.assertEqual(self.printed.number("frame", "floor", exactly=True, threads=2), 1.25)
        self.assertEqual(self.printed.number("frame, n", "median"), 3)
        self.assertEqual(self.printed.number("a | b", "got"), 11.3)
        self.assertEqual(self.printed.number("frame", "p50"), -1.5)

    def test_what_is_not_there(self):
        self.assertIsNone(self.printed.number("frames", "median"))
        self.assertIsNone(self.printed.number("frame", "best"))
        self.assertIsNone(self.printed.number("frame", "floor", exactly=True, threads=1))
        self.assertIsNone(self.printed.number("frame", "got"))
        self.assertIsNone(Printed("").number("", ""))

    def test_two_rows_are_no_answer(self):
        with self.assertRaisesRegex(ValueError, "2 rows begin with 'frame' and have a column 'median'"):
            self.printed.number("frame", "median", threads=2)
        self.assertEqual(self.printed.numbers("frame", "median"), [4, 2.5, 3])


class Judging(unittest.TestCase):
    def setUp(self):
        root = pathlib.Path(tempfile.mkdtemp()).resolve()
        self.addCleanup(shutil.rmtree, root)
        self.bench = root / "bench"
        (self.bench / "tiny").mkdir(parents=True)
        for name in ("all", "printed.py", "quiet.py", "results.py", "table.py", "programs.py"):
            shutil.copy(BENCH / name, self.bench / name)
        shutil.copy(BENCH / "bounds.py", self.bench / "real_bounds.py")
        (self.bench / "bounds.py").write_text(BOUNDS)
        (self.bench / "tiny/run").write_text(TINY)
        (self.bench / "tiny/run").chmod(0o755)

    def judge(self, *words, most_busy=2.0):
        quiet = self.bench / "quiet.py"
        quiet.write_text(re.sub(r"MOST_BUSY = [\d.]+", f"MOST_BUSY = {most_busy}", quiet.read_text()).replace("seconds=3.0", "seconds=0.05"))
        done = subprocess.run([sys.executable, self.bench / "all", "--runs", "1", *words], capture_output=True, text=True, timeout=60)
        verdicts = {cells[0][1]: cells[-1][1] for cells in Printed(done.stdout).rows}
        return done, verdicts

    def test_verdicts(self):
        done, verdicts = self.judge()
        self.assertEqual(verdicts, {"is met": "holds", "is missed": "misses", "enough": "holds", "too few": "misses", "of a peer": "not here",
                                    "of a bench that fails": "not here", "of a row that is not there": "not in what the bench printed",
                                    "out of reach": "misses, and so does its limit", "within reach": "misses"})
        self.assertEqual(done.returncode, 1)
        self.assertIn("bench/tiny --ozz OZZ: needs --ozz", done.stdout)
        self.assertIn("bench/tiny broken: error: tiny: broken", done.stdout)
        self.assertIn("limit of 'out of reach': no work at all", done.stdout)

    def test_a_busy_machine_gives_none(self):
        _, verdicts = self.judge(most_busy=-1)
        self.assertEqual({verdicts[work] for work in ("is met", "is missed", "enough", "too few")}, {"none: busy"})

    def test_a_row_that_a_bench_no_longer_prints_is_a_failure(self):
        self.assertEqual(self.judge("--only", "not there")[0].returncode, 1)
        self.assertEqual(self.judge("--only", "is met,enough")[0].returncode, 0)

    def test_rows_by_their_words(self):
        done, verdicts = self.judge("--only", "too few,met")
        self.assertEqual(list(verdicts), ["is met", "too few"])
        done, _ = self.judge("--only", "nobody")
        self.assertEqual((done.returncode, "no row's name holds one of: nobody" in done.stderr), (2, True))


if __name__ == "__main__":
    unittest.main(verbosity=2)
