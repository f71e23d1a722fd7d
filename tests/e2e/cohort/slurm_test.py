#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The cohort on real Slurm, one node of it: the same bytes as on this machine alone, each job on its core; one cancelled, one out of memory, all of it
resumed."""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.dont_write_bytecode = True
import cohort_test  # noqa: E402
import slurm_node  # noqa: E402
from cohort_test import CONFIG, group, kept  # noqa: E402

# With the 150 MiB of a job itself every participant is planned with 260 MiB: too little, twice that as well, for two million tets.
LAW = "law: {" + ", ".join(f"{step}: {{mib: 110, mib_per_mtet: 0, mib_per_mvoxel: 0}}" for step in ("check", "repair", "preprocess", "verify", "pose", "subject")) + "}\n"


def cores_of_steps(out):
    """Where each `ecorche` at work in a participant's folder may run, as the system lists processors."""
    found = []
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if (process / "comm").read_text().strip() == "ecorche" and (process / "cwd").resolve().parent == out.resolve():
                found.append(re.search(r"Cpus_allowed_list:\s*(\S+)", (process / "status").read_text())[1])
        except OSError:
            pass
    return found


class OnSlurm(unittest.TestCase):
    def setUp(self):
        lacking = slurm_node.missing()
        self.assertEqual(lacking, [], "apt-get install slurm-wlm munge (scripts/setup --all)")
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        cohort_test.phantom_cohort.make(cohort_test.ECORCHE, self.folder / "bids", 4)
        # One that needs far more than it is planned with, and for long enough to be seen.
        (self.folder / "bids/participants.tsv").write_text(
            "participant_id\toptions\nsub-01\tn/a\nsub-02\t--max-tets 2000000 --voxel 2.2\nsub-03\tn/a\nsub-04\tn/a\n")
        (self.folder / "cohort.yaml").write_text(CONFIG)
        (self.folder / "slurm.yaml").write_text(CONFIG + LAW)

    def start(self, node, out, *more):
        words = [cohort_test.ECORCHE, "cohort", self.folder / "bids", out, "participant", "group", "--profile", "slurm",
                 "--config", self.folder / "slurm.yaml", *more]
        return subprocess.Popen(list(map(str, words)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=node.env, cwd=self.folder,
                                start_new_session=True)

    def test_cancelled_out_of_memory_and_resumed(self):
        alone, out = self.folder / "alone", self.folder / "out"
        subprocess.run(list(map(str, [cohort_test.ECORCHE, "--threads", "2", "cohort", self.folder / "bids", alone, "participant", "group",
                                      "--config", self.folder / "cohort.yaml"])), check=True, capture_output=True, cwd=self.folder)
        with slurm_node.SlurmNode(self.folder / "slurm") as node:
            # The first run is killed together with its jobs, when some participant is at work.
            first = self.start(node, out)
            self.until(lambda: any(job["JobState"] == "RUNNING" for job in node.jobs().values()), first)
            cores = self.until(lambda: cores_of_steps(out), first)
            self.assertEqual([where for where in cores if not where.isdigit()], [], "each job has the one core that it asked for")
            time.sleep(1)
            cohort_test.kill_all(first.pid)
            first.communicate()
            node.ask("scancel", *node.jobs())
            self.until(lambda: not any(job["JobState"] in ("RUNNING", "PENDING", "COMPLETING") for job in node.jobs().values()), None)
            before = set(node.jobs())
            self.assertTrue(before)

            second = self.start(node, out)
            cancelled = self.until(lambda: next((number for number, job in node.jobs().items() if number not in before
                                                 and job["JobName"] == "ecorche-sub-02" and job["JobState"] == "RUNNING"), None), second)
            node.ask("scancel", cancelled)
            printed, said = second.communicate(timeout=400)
            self.assertEqual(second.returncode, 0, said[-3000:])
            jobs = {number: job for number, job in node.jobs().items() if number not in before}
            of = lambda name: [job for job in jobs.values() if job["JobName"] == f"ecorche-{name}"]  # noqa: E731
            print(*(f"{number}: {job['JobName']} {job['JobState']} {job['TRES']}" for number, job in sorted(jobs.items())), sep="\n", file=sys.stderr)
            self.assertEqual(jobs[cancelled]["JobState"], "CANCELLED")
            memory = [job["MinMemoryNode"] for job in of("sub-02")]
            self.assertEqual(len(memory), len(set(memory)), f"each attempt asks for more: {memory}")
            killed = [number for number, job in jobs.items() if job["JobName"] == "ecorche-sub-02" and number != cancelled and job["JobState"] != "COMPLETED"]
            said_there = (node.folder / "slurmd.out").read_text() + "".join((out / f".cohort/slurm/{number}.log").read_text() for number in killed)
            self.assertRegex(said_there, r"(?i)exceed\w+ .*memory limit|oom")
            self.assertEqual(of("sub-02")[-1]["JobState"], "COMPLETED")
            self.assertLessEqual(max(len(of(name)) for name in ("sub-01", "sub-03")), 1, "one job a participant")
            done = (out / f".cohort/slurm/{of('sub-02')[-1]['JobId']}.log").read_text()
            self.assertEqual(done.count("Building DAG of jobs"), 1, "one Snakemake a job, none around each step")
        self.assertEqual([row["status"] == "failed" for row in group(out).values()], [False, False, False, True])
        whole, found = kept(alone), kept(out)
        # Only the options of the workflow differ, which the law is none of.
        self.assertEqual(sorted(found), sorted(whole))
        self.assertEqual([name for name in whole if found[name] != whole[name]], [])

    def test_an_array_of_the_readers_own(self):
        page = (cohort_test.ROOT / "docs/how-to/cohort.md").read_text()
        (self.folder / "array.sh").write_text(re.search(r"```text\n(#!/bin/sh\n#SBATCH.*?)```", page, re.DOTALL)[1])
        commands = re.search(r"```sh\n(ls bids .*?)```", page, re.DOTALL)[1]
        (self.folder / "bids/participants.tsv").unlink()  # all of a size
        alone = self.folder / "alone"
        subprocess.run(list(map(str, [cohort_test.ECORCHE, "--threads", "2", "cohort", self.folder / "bids", alone, "participant", "group",
                                      "--config", self.folder / "cohort.yaml"])), check=True, capture_output=True, cwd=self.folder)
        with slurm_node.SlurmNode(self.folder / "slurm") as node:
            path = f"{pathlib.Path(cohort_test.ECORCHE).parent}:{node.env['PATH']}"
            done = subprocess.run(["sh", "-ec", commands], env={**node.env, "PATH": path}, cwd=self.folder, capture_output=True, text=True, timeout=300)
            self.assertEqual(done.returncode, 0, done.stderr[-3000:])
            states = [job["JobState"] for job in node.jobs().values()]
        self.assertEqual(states, ["COMPLETED"] * 4)
        whole, found = kept(alone), kept(self.folder / "results")
        self.assertEqual(sorted(found), sorted(whole))
        self.assertEqual([name for name in whole if found[name] != whole[name]], [])

    def until(self, found, process, seconds=120):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if process is not None and process.poll() is not None:
                self.fail(f"it ended too early: {process.communicate()[1][-3000:]}")
            value = found()
            if value:
                return value
            time.sleep(0.1)
        self.fail("nothing of it within two minutes")


if __name__ == "__main__":
    unittest.main(verbosity=2)
