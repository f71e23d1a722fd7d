#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How benches write their pages (bench/results.py), by benches of one line in a repository of their own; no time is measured."""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BENCH = pathlib.Path(__file__).resolve().parents[3] / "bench"
HEAD = '''#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What is measured, and how."""
import pathlib, subprocess, sys
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import results, table
def main():
'''
END = "\nsys.exit(results.run(main))\n"
TABLE = '    t = table.Table(("what", 8), "ms")\n    t.row("a | b", "1.50")\n    subprocess.run(["echo", "of a child"])\n    table.notes(["in " + sys.argv[1]])\n'


class Results(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp()).resolve()
        self.addCleanup(shutil.rmtree, self.root)
        self.place = self.root / "bench/tiny"
        self.place.mkdir(parents=True)
        for name in ("results.py", "table.py"):
            shutil.copy(BENCH / name, self.root / "bench" / name)
        (self.root / ".gitignore").write_text("__pycache__/\n")
        self.page = self.place / "RESULTS.md"
        self.bench(TABLE)
        self.git("init", "-q")
        self.commit()

    def bench(self, body):
        (self.place / "run").write_text(HEAD + body + END)

    def git(self, *words):
        return subprocess.run(["git", "-C", self.root, "-c", "user.name=nobody", "-c", "user.email=nobody@localhost", *words], check=True, capture_output=True,
                              text=True).stdout.strip()

    def commit(self):
        self.git("add", "-A")
        self.git("commit", "-q", "-m", "all")

    def run_bench(self, *words, code=0):
        done = subprocess.run([sys.executable, self.place / "run", *words], capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stdout

    def test_a_page_says_by_what_it_was_made(self):
        outside = pathlib.Path(tempfile.mkdtemp()).resolve()
        self.addCleanup(shutil.rmtree, outside)
        shown = self.run_bench(outside / "scans", "--results")
        page = self.page.read_text()
        self.assertTrue(page.startswith("<!-- SPDX-License-Identifier: Apache-2.0 -->\n# Results of bench/tiny\n\nWhat is measured, and how.\n"))
        self.assertIn("| command | `bench/tiny/run scans` |", page)
        self.assertIn(f"| commit | {self.git('rev-parse', '--short=12', 'HEAD')} |\n", page)
        for name, pattern in (("date", r"\d{4}-\d\d-\d\d \d\d:\d\d .*minutes"), ("processor", r".+, \d+ cores"), ("memory", r"\d+ GiB|unknown"), ("system", ".+"),
                              ("compiler", "no release build")):
            self.assertRegex(page, rf"(?m)^\| {name} \| {pattern} \|$")
        self.assertIn("| what     |  ms |\n|----------|----:|\n| a \\| b   | 1.50 |\nof a child\n\n- in scans\n", page)
        self.assertNotIn(str(outside), page)
        self.assertIn(str(outside), shown)  # what is shown is as it was printed
        self.assertEqual(sorted(path.name for path in self.place.iterdir()), ["RESULTS.md", "run"])

    def test_without_the_word_nothing_is_written(self):
        self.assertIn("a \\| b", self.run_bench("x"))
        self.assertFalse(self.page.exists())

    def test_changes_are_told_but_not_those_of_pages(self):
        told = re.compile(r"(?m)^\| commit \| .*with changes that are not committed \|$")
        self.page.write_text("old\n")
        self.commit()
        self.run_bench("x", "--results")
        self.run_bench("x", "--results")  # beside a page that has changed
        self.assertNotRegex(self.page.read_text(), told)
        (self.root / "new.txt").write_text("new\n")
        self.run_bench("x", "--results")
        self.assertRegex(self.page.read_text(), told)

    def test_only_a_whole_run_replaces_the_page(self):
        for body, code in (('    print("half")\n    raise ValueError("broken")', 1), ('    print("half")\n    raise SystemExit("error: broken")', 1),
                           ('    print("half")\n    sys.exit(0)', 0)):
            self.page.write_text("old\n")
            self.bench(body)
            self.run_bench("--results", code=code)
            self.assertEqual(self.page.read_text(), "old\n")
        # What was asked does not hold: the run is whole, its page says so.
        self.bench('    print("DOES NOT HOLD")\n    return 1')
        self.run_bench("--results", code=1)
        self.assertTrue(self.page.read_text().endswith("\nDOES NOT HOLD\n"))


class EveryBench(unittest.TestCase):
    def test_has_a_page_and_stands_in_the_list(self):
        listed = subprocess.run([BENCH / "all_results", "--list", "--data", "/data"], check=True, capture_output=True, text=True, timeout=60).stdout
        entries = sorted(str(path.parent.relative_to(BENCH)) for path in BENCH.glob("**/run"))
        self.assertEqual(sorted(line.split()[0] for line in listed.splitlines()), entries)
        for name in entries:
            self.assertIn("sys.exit(results.run(main))", (BENCH / name / "run").read_text(), name)


if __name__ == "__main__":
    unittest.main()
