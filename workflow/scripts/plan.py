# SPDX-License-Identifier: Apache-2.0
"""What the rules ask: who takes part, what each step is given and planned with, what is to be made."""
import fcntl
import functools
import json
import os
import pathlib
import shlex
import subprocess
import sys

import yaml
from snakemake.common import Mode
from snakemake.exceptions import WorkflowError
from snakemake.utils import validate

import law
import participants
import record
import samples
import step_forks

ATTEMPTS = 3  # of a step that its machine failed
MOST_NAMED = 100  # participants whose locks one run holds, an open file each


class Plan:
    def __init__(self, config, workflow):
        self.workflow, self.base = workflow, pathlib.Path(workflow.basedir)
        self.config = {**yaml.safe_load((self.base / "config/config.yaml").read_text()), **config}
        self.main = workflow.mode == Mode.default  # not a job that Snakemake started
        try:
            self.set_up()
        except participants.Refused as refused:
            print(f"error: {refused}", file=sys.stderr, flush=True)
            os._exit(refused.code)  # Snakemake would say it once more, as a fault of this file

    def set_up(self):
        said = self.against("config", self.config)
        if said:
            raise participants.Refused("configuration", said, "see docs/reference/cohort.md")
        self.out = pathlib.Path(self.config["out"]).resolve()
        bids = pathlib.Path(self.config["bids"]).resolve()
        self.root = str(bids.parent if bids.is_file() else bids)
        self.labels = [label for label in self.config.get("labels", "").split(",") if label]
        self.data = os.path.abspath(os.path.join(self.config.get("from", os.getcwd()), self.config["data"])) if self.config["data"] else ""
        if self.data and not os.path.isdir(self.data):
            raise participants.Refused("configuration: data", f"no folder {self.data}", "give its path from the folder where you are", 66)
        people = participants.read(bids, lambda row: self.against("participants", row), self.labels, self.data)
        self.people = {one.id: one for one in people}
        self.threads = self.config["threads"]
        # Samples of few participants are made side by side by all processors of this machine.
        cores = self.workflow.global_resources["_cores"] or 1
        self.sample_threads = self.threads if self.config.get("cluster") else max(self.threads, cores // max(1, len(self.people)))
        self.ecorche = self.config["ecorche"]
        self.program = {"version": self.version(), "sha256": record.sha256(self.ecorche)}
        self.python, self.scripts = shlex.quote(sys.executable), shlex.quote(str(self.base / "scripts"))
        self.ecorche_q, self.forks = shlex.quote(self.ecorche), step_forks.StepForks()
        self.levels = self.config.get("levels", "participant,group").split(",")
        self.law = yaml.safe_load((self.base / "resources.yaml").read_text())
        for step, line in self.config.get("law", {}).items():
            if step not in self.law:
                raise participants.Refused("configuration: law", f"no step '{step}'", f"one of {', '.join(self.law)}")
            self.law[step] = {**self.law[step], **line}
        self.poses = self.config["poses"]
        for name in self.poses:
            for path in self.pose_files(name):
                if not os.path.isfile(path):
                    raise participants.Refused(f"configuration: poses.{name}", f"no file {path}", "give its path from the folder where you are, or lib:NAME", 66)
        for name in self.people if self.config["landmarks"] and self.config["sample"] else []:
            if not os.path.isfile(self.landmark_file(name)):
                raise participants.Refused("configuration: landmarks", f"no file {self.landmark_file(name)}", "give its path from the folder where you are", 66)
        if self.main:
            self.lock()
            record.take_back(self.out, self.people)
            self.bound_memory()
        self.with_status = sorted(path.parent.parent.name for path in self.out.glob("sub-*/steps/subject.json"))

    def against(self, schema, data):
        """The first thing that a schema says against `data`, or nothing."""
        try:
            validate(data, str(self.base / "schemas" / f"{schema}.schema.yaml"), set_default=False)
        except WorkflowError as error:
            import jsonschema
            checked = jsonschema.Draft7Validator(yaml.safe_load((self.base / "schemas" / f"{schema}.schema.yaml").read_text()))
            worst = min(checked.iter_errors(data), key=lambda one: list(map(str, one.absolute_path)), default=None)
            return f"{'.'.join(map(str, worst.absolute_path))}: {worst.message}".lstrip(": ") if worst else str(error)
        return ""

    def version(self):
        try:
            return subprocess.run([self.ecorche, "--version"], stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
        except (OSError, subprocess.CalledProcessError) as error:
            raise participants.Refused(self.ecorche, f"does not run: {error}", "name the program with --config ecorche=PATH", 66) from None

    def lock(self):
        """One run at a time in a folder; or several, as tasks of a job array are, each of other participants, which it names, and of no group. A
        lock goes with the process: a killed run leaves none."""
        some = self.labels and self.levels == ["participant"] and len(self.people) <= MOST_NAMED
        self.held = [self.locked("lock", self.out, fcntl.LOCK_SH if some else fcntl.LOCK_EX)]
        self.held += [self.locked(f"lock-{name}", f"{self.out}/{name}", fcntl.LOCK_EX) for name in self.people] if some else []

    def locked(self, name, what, how):
        (self.out / ".cohort").mkdir(parents=True, exist_ok=True)
        file = open(self.out / ".cohort" / name, "w")
        try:
            fcntl.flock(file, how | fcntl.LOCK_NB)
        except OSError:
            raise participants.Refused(what, "another run of this cohort is at work here", "wait for its end, or name another folder", 75) from None
        return file

    def bound_memory(self):
        """All jobs of this machine together take no more than it has; on a cluster every node sees to that itself."""
        if "mem_mb" not in self.workflow.global_resources and not self.config.get("cluster"):
            free = next(int(line.split()[1]) for line in open("/proc/meminfo") if line.startswith("MemAvailable"))
            self.workflow.global_resources["mem_mb"] = free * 9 // 10 // 1024

    # What a step depends on.

    @functools.cached_property
    def given(self):
        """For each rule a function to JSON: all that its result depends on besides its input files. It stands in a command line, where a
        word has 128 KiB at most: no lists of files."""
        scan = lambda who: [] if self.is_case(who) else ["new"]  # noqa: E731
        depends = {
            "new": lambda who: {"files": self.sources(who)},
            "check": lambda who: {"files": self.sources(who), "is_case": self.is_case(who), "root": self.root, "data": self.data_of(who),
                                  "repair": self.config["repair"] is not False, "after": scan(who)},
            "repair": lambda who: {"repair": self.config["repair"] is not False, "words": self.repair_words(), "data": self.data_of(who), "after": ["check"]},
            "preprocess": lambda who: {"words": self.preprocess_words(who), "cache_gib": self.config["cache_gib"], "after": ["repair"]},
            "verify": lambda who: {"after": ["preprocess"]},
            "pose": lambda pose: {"words": self.pose_words(pose), "after": ["verify"]},
            "sample": lambda who: {"count": self.config["sample"], "seed": self.config["seed"], "reach": self.config["reach"], "views": self.config["views"],
                                   "words": samples.WORDS, "landmarks": self.landmarks(who), "after": ["verify"]},
            "subject": lambda who: {"options": self.options(who), "after": self.told(who)},
            "group": lambda: {"names": self.group_names(), "unfinished": self.unfinished()},
            "description": lambda: {"source": self.root},
        }
        return {rule: lambda *of, more=more: json.dumps({"program": self.program, **more(*of)}, sort_keys=True) for rule, more in depends.items()}

    def sources(self, participant):
        return [str(path) for path in self.people[participant].sources]

    def files(self, participant):
        return [str(path) for path in self.people[participant].files()]

    def is_case(self, participant):
        return self.people[participant].is_case

    def data_of(self, participant):
        """Where a case of one's own may have files; `ecorche new` makes none that does."""
        return self.data if self.is_case(participant) else ""

    def preprocess_words(self, participant):
        """Those of the table come last and win."""
        own = self.people[participant].options
        common = {f"--{name}": value for name, value in self.config["preprocess"].items() if f"--{name}" not in own}
        if self.data_of(participant):
            common["--data"] = self.data
        return [word for name, value in sorted(common.items()) for word in (name, str(value))] + own

    def repair_words(self):
        return self.words(self.config["repair"]) if isinstance(self.config["repair"], dict) else []

    def pose_words(self, pose):
        return self.words({**self.poses[pose], **self.config["pose"]})

    def words(self, options):
        """As the command line has them."""
        words = []
        for name, value in options.items():
            values = value if isinstance(value, list) else [value]
            if isinstance(value, bool):
                words += [f"--{name}"] if value else []
            else:
                words += [word for one in values for word in (f"--{name}", self.absolute(name, str(one)))]
        return words

    def absolute(self, name, value):
        return os.path.join(self.config.get("from", os.getcwd()), value) if name in ("pose", "motion") and not value.startswith("lib:") else value

    def pose_files(self, pose):
        given = self.poses[pose]
        return [self.absolute(name, given[name]) for name in ("pose", "motion") if name in given and not given[name].startswith("lib:")]

    def landmark_file(self, participant):
        return os.path.join(self.config.get("from", os.getcwd()), self.config["landmarks"].replace("{participant}", participant))

    def landmarks(self, participant):
        """With its digest: other points at the same place are other landmarks."""
        if not self.config["landmarks"]:
            return None
        path = self.landmark_file(participant)
        return {"file": path, "sha256": record.sha256(path)}

    def told(self, participant):
        """The steps that a participant's page tells of."""
        scan = [] if self.is_case(participant) else ["new"]
        return [*scan, "check", "repair", "preprocess", "verify", *(f"pose-{pose}" for pose in self.poses), *(["sample"] if self.config["sample"] else [])]

    def options(self, participant):
        return {"preprocess": self.preprocess_words(participant), "repair": self.config["repair"] if self.config["repair"] is False else self.repair_words(),
                "poses": {name: self.pose_words(name) for name in self.poses}}

    # How it is made.

    def run(self, step, participant, given, threads, resources):
        """A step's job, on a thread of Snakemake's."""
        code = self.forks.run(step=step, participant=participant, out=str(self.out), ecorche=self.ecorche, given=given, threads=threads,
                              mib=resources.hold_mib, attempt=resources.attempt, attempts=resources.attempts)
        if code != 0:
            raise RuntimeError(f"{step} of {participant} ended with {code} (see {participant}/log/{step}.log)")

    # What it is planned with.

    def size_of(self, participant):
        return law.size_of(tuple(self.preprocess_words(participant)), tuple(self.files(participant)))

    def resources(self, step):
        size = (lambda wc: self.size_of(wc.participant)) if step != "group" else (lambda wc: (0, 0))
        hold = self.config["hold_memory"]
        side_by_side = self.sample_threads if step == "sample" else 1
        beside = self.law["job"]["mib"] if self.config.get("cluster") else 0  # a Snakemake of its own
        return {"mem_mb": lambda wc, attempt: side_by_side * law.mib(self.law, step, size(wc), attempt, beside),
                "hold_mib": lambda wc, attempt: law.mib(self.law, step, size(wc), attempt) if hold else 0,
                "runtime": lambda wc, attempt: law.minutes(self.law, step, size(wc), attempt, self.config["sample"] if step == "sample" else 1),
                "attempt": lambda wc, attempt: attempt, "attempts": ATTEMPTS, "at_once": 1}

    # What is to be made.

    def finished(self, participant):
        return f"{participant}/steps/subject.json"

    def group_names(self):
        """Of all who were ever done here, and of all who will be by this run."""
        return sorted({*self.with_status, *(self.people if "participant" in self.levels else [])})

    def unfinished(self):
        return [] if "participant" in self.levels else sorted(set(self.people) - set(self.with_status))

    def group_input(self):
        return [self.finished(name) for name in self.group_names()]

    def targets(self):
        own = [self.finished(name) for name in self.people] if "participant" in self.levels else []
        return [*own, *(["group.html"] if "group" in self.levels else []), "dataset_description.json"]
