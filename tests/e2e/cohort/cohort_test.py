#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""ecorche cohort: four phantoms, one of them broken; what runs again after which change, a kill at any moment, machines that fail."""
import csv
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests/support"), str(pathlib.Path(__file__).resolve().parent)]
sys.dont_write_bytecode = True
import phantom_cohort  # noqa: E402
from processes import alive, below, kill_all  # noqa: E402

ECORCHE = os.environ["ECORCHE_BIN"]
CONFIG = """
preprocess: {mesher: lattice, max-tets: 20000}
poses: {sitting: {pose: "lib:sitting"}}
pose: {tissues: skin, volumes: labels, format: [stl], volume-format: nii.gz}
"""
# What is measured, and what Snakemake keeps for itself.
MEASURED = re.compile(r"(^|/)(log|\.snakemake|\.cohort)(/|$)|report\.html$|group\.html$")
TIMES = ("prepare_s", "peak_mib")


def group(out):
    with open(out / "group.tsv", newline="") as file:
        return {row["participant_id"]: row for row in csv.DictReader(file, delimiter="\t")}


def kept(out):
    """The bytes of all results, without what is measured."""
    found = {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*"))
             if path.is_file() and not MEASURED.search(str(path.relative_to(out)))}
    found["group.tsv"] = str({name: {key: value for key, value in row.items() if key not in TIMES} for name, row in group(out).items()}).encode()
    whole = json.loads(found["group.json"])
    for row in whole["participants"]:
        for name in TIMES:
            row["figures"].pop(name)
    found["group.json"] = json.dumps([whole["counts"], whole["participants"]]).encode()
    return found


class Cohort(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.base = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.base)
        cls.expected = phantom_cohort.make(ECORCHE, cls.base / "bids", 4)
        (cls.base / "cohort.yaml").write_text(CONFIG)
        cls.first = cls.base / "first"
        cls.done = cls.call(cls.base / "bids", cls.first)

    @classmethod
    def words(cls, bids, out, *more, levels=("participant", "group"), ecorche=ECORCHE):
        return [ecorche, "--threads", "2", "cohort", bids, out, *levels, *(() if "--config" in more else ("--config", cls.base / "cohort.yaml")), *more]

    @classmethod
    def call(cls, *words, code=0, **more):
        env = more.pop("env", None)
        done = subprocess.run(list(map(str, cls.words(*words, **more))), capture_output=True, text=True, timeout=120, cwd=cls.base, env=env)
        assert done.returncode == code, (done.returncode, done.stdout, done.stderr)
        return done

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def would_run(self, bids, out, *more, **others):
        """{rule: how often}, of a dry run."""
        said = self.call(bids, out, "--dry-run", *more, **others).stderr
        table = re.search(r"Job stats:\njob .*\n[- ]+\n((?:\w+ .*\n)+)", said)
        found = {line.split()[0]: int(line.split()[1]) for line in table[1].splitlines()} if table else {}
        return {rule: count for rule, count in found.items() if rule not in ("total", "all")}

    def test_everybody_has_results_and_the_broken_one_a_reason(self):
        rows = group(self.first)
        self.assertEqual(list(rows), list(self.expected))
        for name, code in self.expected.items():
            folder = self.first / name
            for file in ("report.html", "check.json", "quality.tsv", "status.json", "provenance.json", "log"):
                self.assertTrue((folder / file).exists(), file)
            self.assertEqual(rows[name]["status"] == "failed", code != 0, rows[name])
            self.assertEqual((folder / "model.hdf").exists(), code == 0)
        broken = rows["sub-04"]
        self.assertEqual((broken["step"], broken["fault"], broken["exit_code"]), ("check", "data", "78"))
        self.assertRegex(broken["error"], r"case\.yaml:\d+:bones\[0\]\.segment: unknown segment 'pelviss' \(did you mean 'pelvis'\?\)")
        self.assertEqual(broken["tets"], "n/a")
        self.assertLessEqual(int(rows["sub-01"]["tets"]), 20000)
        quality = (self.first / "sub-01/quality.tsv").read_text().splitlines()
        self.assertEqual([line.split("\t")[0] for line in quality], ["pose", "sitting"])
        posed = json.loads((self.first / "sub-01/posed/sitting/quality.json").read_text())
        self.assertAlmostEqual(float(rows["sub-01"]["sitting.inverted_ml"]), posed["inverted_rest_mm3"] / 1000, places=6)
        self.assertAlmostEqual(float(rows["sub-01"]["sitting.volume_change"]), posed["volume_change"], places=9)
        whole = json.loads((self.first / "group.json").read_text())
        self.assertEqual(whole["counts"]["failed"], 1)
        self.assertEqual(whole["participants"][3]["failed"]["exit_code"], 78)
        self.assertIn("1 failed", self.done.stdout)
        description = json.loads((self.first / "dataset_description.json").read_text())
        self.assertEqual((description["DatasetType"], description["GeneratedBy"][0]["Name"]), ("derivative", "ecorche"))
        provenance = json.loads((self.first / "sub-01/provenance.json").read_text())
        self.assertIn("sub-01/case.yaml", provenance["inputs"])
        self.assertIn("--max-tets", provenance["options"]["preprocess"])

    def test_the_page_needs_no_network_and_names_who_failed(self):
        page = (self.first / "group.html").read_text()
        self.assertNotRegex(page, r"https?://|<link|src='(?!data:)|@import")
        self.assertIn("href='sub-01/report.html'", page)
        self.assertRegex(page, r"<li><a href='sub-04/report.html'>sub-04</a>, check: .*unknown segment &#39;pelviss&#39;")
        for name in self.expected:
            self.assertNotRegex((self.first / name / "report.html").read_text(), r"https?://|<link|<script")
        self.assertIn("<h2>Poses</h2>", (self.first / "sub-01/report.html").read_text())

    def test_the_page_searches_and_sorts(self):
        # A script of ours at the page's end does what a reader would, and says what is then to be seen.
        does = """<script>
const names=()=>[...document.querySelectorAll('#all tbody tr')].filter(row=>!row.hidden).map(row=>row.cells[0].textContent).join(' ');
const found={first:names(),wide:document.documentElement.scrollWidth<=document.documentElement.clientWidth};
const heads=[...document.querySelectorAll('#all th button')],by=name=>heads.find(head=>head.textContent===name).click();
by('tets');found.up=names();by('tets');found.down=names();by('participant');by('participant');found.named=names();
const search=document.querySelector('#search');search.value='failed pelviss';search.dispatchEvent(new Event('input'));
found.searched=names();found.said=document.querySelector('#shown').textContent;
document.body.innerHTML='<pre>'+JSON.stringify(found)+'</pre>'</script>"""
        page = self.folder / "group.html"
        page.write_text((self.first / "group.html").read_text().replace("</body>", does + "</body>"))
        rows = group(self.first)
        tets = sorted((name for name in rows if rows[name]["tets"] != "n/a"), key=lambda name: float(rows[name]["tets"]))
        for width in (1280, 390):
            printed = subprocess.run(["chromium", "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={self.folder}/browser{width}",
                                      f"--window-size={width},900", "--dump-dom", page.as_uri()], capture_output=True, text=True, timeout=60).stdout
            found = json.loads(re.search(r"<pre>(.*)</pre>", printed)[1])
            self.assertEqual(found, {"first": "sub-01 sub-02 sub-03 sub-04", "wide": True, "up": " ".join([*tets, "sub-04"]),
                                     "down": " ".join([*tets[::-1], "sub-04"]), "named": "sub-04 sub-03 sub-02 sub-01", "searched": "sub-04",
                                     "said": "1 of 4 shown"})

    def test_only_what_changed_is_made_again(self):
        bids, out, other = self.base / "bids", self.first, self.folder / "other.yaml"
        self.assertEqual(self.would_run(bids, out), {})
        rest = {"check": 1, "repair": 1, "preprocess": 1, "verify": 1, "pose": 1, "subject": 1, "group": 1}
        with self.subTest("a file"):
            case = bids / "sub-02/case.yaml"
            text = case.read_text()
            case.write_text(text + "# looked at\n")
            self.assertEqual(self.would_run(bids, out), rest)
            case.write_text(text)
        with self.subTest("a file's time alone"):
            os.utime(case)
            self.assertEqual(self.would_run(bids, out), {})
        with self.subTest("an option of everybody"):
            other.write_text(CONFIG.replace("20000", "15000"))
            self.assertEqual(self.would_run(bids, out, "--config", other), {"preprocess": 4, "verify": 4, "pose": 4, "subject": 4, "group": 1})
        with self.subTest("an option of one"):
            table = bids / "participants.tsv"
            text = table.read_text()
            table.write_text("participant_id\toptions\nsub-01\tn/a\nsub-02\t--max-tets 15000\nsub-03\t\nsub-04\t\n")
            self.assertEqual(self.would_run(bids, out), {"preprocess": 1, "verify": 1, "pose": 1, "subject": 1, "group": 1})
            table.write_text(text)
        with self.subTest("a further pose"):
            other.write_text(CONFIG.replace("poses: {", 'poses: {arms_up: {pose: "lib:arms_up"}, '))
            self.assertEqual(self.would_run(bids, out, "--config", other), {"pose": 4, "subject": 4, "group": 1})
        with self.subTest("another version of the program"):
            changed = self.folder / "changed"
            changed.write_text(f'#!/bin/sh\nexec {ECORCHE} "$@"\n')
            changed.chmod(0o755)
            everybody = {rule: 4 for rule in rest if rule != "group"}
            # The front names itself as the program: the last word wins.
            words = ("--snakemake", f"--config bids={bids} out={out} ecorche={changed} from={self.base}")
            self.assertEqual(self.would_run(bids, out, *words), {**everybody, "group": 1, "description": 1})
        with self.subTest("a result that is gone"):
            (out / "sub-03/model.hdf").unlink()
            self.assertEqual(self.would_run(bids, out), {"preprocess": 1, "verify": 1, "pose": 1, "subject": 1, "group": 1})
            self.call(bids, out)
            self.assertTrue((out / "sub-03/model.hdf").exists())
        with self.subTest("a further participant"):
            shutil.copytree(bids / "sub-01", bids / "sub-05")
            self.addCleanup(shutil.rmtree, bids / "sub-05")
            table = bids / "participants.tsv"
            text = table.read_text()
            self.addCleanup(table.write_text, text)
            table.write_text(text + "sub-05\tn/a\n")
            self.assertEqual(self.would_run(bids, out), rest)
        with self.subTest("one participant alone"):
            self.assertEqual(self.would_run(bids, out, "--participant-label", "05", levels=("participant",)),
                             {rule: count for rule, count in rest.items() if rule != "group"})

    def test_killed_and_run_again_it_is_as_if_undisturbed(self):
        whole = kept(self.first)
        out = self.folder / "out"
        for seen in ("check", "preprocess", "pose-sitting"):
            process = subprocess.Popen(list(map(str, self.words(self.base / "bids", out))), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                       cwd=self.base, start_new_session=True)
            while process.poll() is None and not list(out.glob(f"sub-*/steps/{seen}.json")):
                time.sleep(0.005)
            self.assertIsNone(process.poll(), "it ended before it was killed")
            kill_all(process.pid)
            process.wait()
        self.call(self.base / "bids", out)
        self.assertEqual({name: len(data) for name, data in kept(out).items()}, {name: len(data) for name, data in whole.items()})
        self.assertEqual([name for name, data in kept(out).items() if data != whole[name]], [])

    def test_a_machine_that_fails_is_tried_again_with_twice_the_memory(self):
        shutil.copytree(self.base / "bids", self.folder / "bids")
        bids, out = self.folder / "bids", self.folder / "out"
        # Planned with a third of what it holds, each step is killed twice; that of sub-02 always, as the kernel would.
        program = self.folder / "program"
        program.write_text(f"""#!/bin/sh
case "$*" in *" preprocess "*sub-02*) [ -e {self.folder}/mended ] || kill -9 $$ ;; esac
exec {ECORCHE} "$@"
""")
        program.chmod(0o755)
        config = self.folder / "cohort.yaml"
        config.write_text(CONFIG + "law: {preprocess: {mib: 35, mib_per_mtet: 0, mib_per_mvoxel: 0}}\n")
        words = ("--config", config, "--snakemake", f"--config bids={bids} out={out} ecorche={program} from={self.base}")
        said = self.call(bids, out, *words)
        planned = {name: re.findall(rf"rule preprocess:\n(?:    .*\n)*?    wildcards: participant={name}\n(?:    .*\n)*?    resources: .*hold_mib=(\d+)", said.stderr)
                   for name in self.expected}
        self.assertEqual(planned, {**dict.fromkeys(("sub-01", "sub-02", "sub-03"), ["35", "70", "140"]), "sub-04": ["35"]})  # which only passes on a fault
        rows = group(out)
        self.assertNotEqual(rows["sub-01"]["status"], "failed")
        self.assertNotEqual(rows["sub-03"]["status"], "failed")
        self.assertEqual((rows["sub-02"]["status"], rows["sub-02"]["fault"], rows["sub-02"]["exit_code"]), ("failed", "machine", "137"), said.stderr)
        self.assertIn("for want of memory", rows["sub-02"]["error"])
        self.assertEqual(rows["sub-04"]["fault"], "data")
        # Run again, it alone is tried again.
        self.assertEqual(self.would_run(bids, out, *words), {"preprocess": 1, "verify": 1, "pose": 1, "subject": 1, "group": 1})
        (self.folder / "mended").touch()
        self.call(bids, out, *words)
        self.assertNotEqual(group(out)["sub-02"]["status"], "failed")

    def test_a_holed_skin_is_mended_where_that_is_allowed(self):
        shutil.copytree(self.base / "bids", self.folder / "bids")
        bids = self.folder / "bids"
        skin = bids / "sub-01/skin.stl"
        data = skin.read_bytes()
        triangles = int.from_bytes(data[80:84], "little") - 3
        skin.write_bytes(data[:80] + triangles.to_bytes(4, "little") + data[84:84 + 50 * triangles])
        config = self.folder / "cohort.yaml"
        rows = {}
        for allowed in ("false", "{holes: 400}"):
            config.write_text(CONFIG + f"repair: {allowed}\n")
            self.call(bids, self.folder / "out", "--config", config, "--participant-label", "01")
            rows[allowed] = group(self.folder / "out")["sub-01"]
        self.assertEqual((rows["false"]["status"], rows["false"]["step"], rows["false"]["exit_code"]), ("failed", "check", "65"))
        self.assertIn("skin", rows["false"]["error"])
        self.assertNotEqual(rows["{holes: 400}"]["status"], "failed", rows)
        self.assertEqual(rows["{holes: 400}"]["repaired"], "yes")

    def test_a_scan_with_its_segmentation_and_a_table_that_names_it(self):
        subprocess.run([ECORCHE, "phantom", "-o", self.folder / "scan", "--size", "small", "--voxel", "12", "--scan", "totalsegmentator_ml"],
                       check=True, stdout=subprocess.DEVNULL)
        files = ";".join(sorted(path.name for path in (self.folder / "scan").iterdir() if path.name != "truth.yaml"))
        table = self.folder / "scan/participants.tsv"
        table.write_text(f"participant_id\tage\tfiles\toptions\nsub-A1\t40\t{files}\t--max-tets 20000\n")
        self.call(table, self.folder / "out")
        row = group(self.folder / "out")["sub-A1"]
        self.assertNotEqual(row["status"], "failed", row)
        self.assertTrue((self.folder / "out/sub-A1/case/case.yaml").exists())

    def test_the_group_alone_tells_who_is_not_done(self):
        out = self.folder / "out"
        self.call(self.base / "bids", out, "--participant-label", "sub-01", levels=("participant",))
        self.assertFalse((out / "group.html").exists())
        self.call(self.base / "bids", out, levels=("group",))
        self.assertEqual([row["status"] in ("pass", "warn") for row in group(out).values()], [True, False, False, False])
        self.assertEqual(group(out)["sub-02"]["status"], "unfinished")

    def test_what_is_refused(self):
        bad = self.folder / "bad.yaml"
        table = self.folder / "participants.tsv"

        def said(code, *words, levels=("participant",), text=None, rows=None, **more):
            if text is not None:
                bad.write_text(text)
            if rows is not None:
                table.write_text(rows)
            done = self.call(*words, code=code, levels=levels, **more)
            errors = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
            self.assertEqual(len(errors), 1, done.stderr)
            self.assertRegex(errors[0], r"^error: .+: .+ \(.+\)$")
            return errors[0]

        bids, out = self.base / "bids", self.folder / "out"
        self.assertIn("'prepare' was unexpected", said(78, bids, out, "--config", bad, text="prepare: {}\n"))
        self.assertIn("poses.sitting", said(78, bids, out, "--config", bad, text="poses: {sitting: {motion: walk.bvh}}\n"))
        self.assertIn("no file", said(66, bids, out, "--config", bad, text="poses: {sitting: {pose: nowhere.yaml}}\n"))
        self.assertIn("cannot be read", said(66, bids, out, "--config", self.folder / "nowhere.yaml"))
        self.assertIn("does not exist", said(66, self.folder / "nowhere", out))
        self.assertIn("names no participant", said(66, self.folder, out))
        self.assertIn("no column participant_id", said(78, table, out, rows="name\nsub-01\n"))
        self.assertIn("tsv:3", said(78, table, out, rows="participant_id\nsub-01\nsub_02\n"))
        self.assertIn("line 2 too", said(78, table, out, rows="participant_id\nsub-01\nsub-01\n"))
        self.assertIn("options", said(78, table, out, rows="participant_id\toptions\nsub-01\t--output /etc/passwd\n"))
        self.assertIn("has no sub-77", said(78, bids, out, "--participant-label", "77"))
        self.assertIn("is no label", said(64, bids, out, "--participant-label", "../x"))
        self.assertIn("no profile", said(66, bids, out, "--profile", "nowhere"))
        line = said(66, bids, out, env={**os.environ, "PATH": str(self.folder)})
        self.assertIn("snakemake is not installed", line)
        self.assertIn("apt-get install", line)
        self.assertIn("at work here", self.while_locked(out, lambda: said(75, bids, out)))

    def test_what_a_report_refuses(self):
        def said(code, *words):
            done = subprocess.run([ECORCHE, "report", *map(str, words)], capture_output=True, text=True)
            self.assertEqual(done.returncode, code, done.stderr)
            return done.stderr

        self.assertIn("status.json: is not there (name a participant's folder of a cohort", said(66, "participant", self.folder))
        self.assertIn("holds no participant (name a folder of results", said(66, "group", self.folder))
        shutil.copytree(self.first / "sub-01", self.folder / "sub-01")
        (self.folder / "sub-01/log/stages.json").write_text('[{"name": 3}]')
        self.assertIn("is not what `ecorche preprocess --json` prints as stages (run the cohort again)", said(65, "participant", self.folder / "sub-01"))
        (self.folder / "sub-01/status.json").write_text("{}")
        self.assertIn("is not the status that a cohort writes (remove the participant's folder", said(65, "group", self.folder))

    def while_locked(self, out, do):
        (out / ".cohort").mkdir(parents=True, exist_ok=True)
        with subprocess.Popen(["flock", out / ".cohort/lock", "sh", "-c", "echo ready; read wait"], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
            other.stdout.readline()
            found = do()
            other.stdin.close()
        return found

    def test_one_object_as_json_and_an_installed_program(self):
        prefix = self.folder / "prefix"
        (prefix / "bin").mkdir(parents=True)
        shutil.copy(ECORCHE, prefix / "bin/ecorche")
        words = list(map(str, self.words(self.base / "bids", self.folder / "out", "--dry-run", ecorche=prefix / "bin/ecorche")))
        words.insert(1, "--json")
        alone = subprocess.run(words, capture_output=True, text=True, cwd=self.base)
        self.assertEqual(alone.returncode, 66)
        self.assertIn("neither beside nor above", json.loads(alone.stdout)["error"]["what"])
        shutil.copytree(ROOT / "workflow", prefix / "share/ecorche/workflow")
        done = subprocess.run(words, capture_output=True, text=True, cwd=self.base)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["exit_code"], 0)
        self.assertIn("preprocess", done.stderr)

    def test_a_stop_ends_it_and_all_that_it_started(self):
        process = subprocess.Popen(list(map(str, self.words(self.base / "bids", self.folder / "out"))), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True, cwd=self.base)
        out = self.folder / "out"
        while process.poll() is None and not list(out.glob("sub-*/log/preprocess.log")):
            time.sleep(0.02)
        started = below(process.pid)
        self.assertGreaterEqual(len(started), 4)  # it, Snakemake, the Python of steps, a step
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=20)
        self.assertEqual(process.returncode, 130, said)
        self.assertIn("error: cohort: stopped (run it again: what is done is kept)", said)
        end = time.monotonic() + 5
        while time.monotonic() < end and any(alive(one) for one in started):
            time.sleep(0.05)
        self.assertEqual([one for one in started if alive(one)], [])
        self.assertEqual([path for path in out.glob("sub-*/steps/*.json") if json.loads(path.read_text())["fault"] == "machine"], [])

    def test_what_it_started_ends_with_a_snakemake_that_was_killed(self):
        bids, out, program = self.base / "bids", self.folder / "out", self.folder / "program"
        program.write_text(f'#!/bin/sh\ncase "$*" in *" preprocess "*) exec sleep 100 ;; esac\nexec {ECORCHE} "$@"\n')
        program.chmod(0o755)
        words = self.words(bids, out, "--snakemake", f"--config bids={bids} out={out} ecorche={program} from={self.base}")
        process = subprocess.Popen(list(map(str, words)), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=self.base)
        names = lambda: [pathlib.Path(f"/proc/{one}/comm").read_text().strip() for one in below(process.pid) if alive(one)]  # noqa: E731
        while process.poll() is None and "sleep" not in names():
            time.sleep(0.02)
        started = below(process.pid)
        os.kill(started[1], signal.SIGKILL)
        self.assertEqual(process.wait(20), 137)
        end = time.monotonic() + 10
        while time.monotonic() < end and any(alive(one) for one in started):
            time.sleep(0.05)
        self.assertEqual([one for one in started if alive(one)], [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
