#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""One step for one participant: runs `ecorche`, keeps what it printed, and writes how it ended as steps/STEP.json.

A fault of the data (exit 64, 65, 66, 77, 78) is written down and ends this with 0, so that it stops nobody: the steps that follow see it
and pass it on. A fault of the machine (killed, no memory, a full disk) ends this with its exit code, and Snakemake tries again with twice
the memory; at the last attempt it is written down, too. The next run of the cohort takes such a record back (scripts/record.py).
"""
import argparse
import contextlib
import ctypes
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import threading
import time

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import record  # noqa: E402

DATA_FAULTS = {64, 65, 66, 77, 78}
NOT_ITS_POSE = "has none of the joints of the pose"  # what `ecorche pose` says where a leg is to raise its arms
STOPPED = {130, 143}  # somebody wants an end: neither tried again at once nor written down


LIBC = ctypes.CDLL(None)  # before any fork: other threads may hold the loader's lock then


def end_with_parent():
    LIBC.prctl(1, signal.SIGTERM)


class Fault(Exception):
    def __init__(self, code, said):
        self.code, self.said = code, said


class Step:
    def __init__(self, options):
        self.name, self.options, self.given = options.step, options, json.loads(options.given)
        self.folder = pathlib.Path(options.out) / options.participant
        self.log = self.folder / "log" / f"{self.name}.log"
        self.before = [json.loads((self.folder / "steps" / f"{name}.json").read_text()) for name in self.given.get("after", [])]
        self.seconds, self.peak_mib = 0.0, 0.0
        self.children, self.stopped = set(), False  # process ids
        signal.signal(signal.SIGTERM, self.stop)
        signal.signal(signal.SIGINT, self.stop)

    def stop(self, which, _):
        """No further command is called, and those that run end."""
        self.stopped = True
        # An interrupt comes to all of a process group: those that run have it, and would take a second one for haste.
        for child in list(self.children) if which == signal.SIGTERM else []:
            with contextlib.suppress(ProcessLookupError):
                os.kill(child, signal.SIGTERM)

    def fact(self, name):
        return next(before["facts"][name] for before in reversed(self.before) if name in before["facts"])

    def run(self):
        for folder in (self.folder / "steps", self.folder / "log"):
            folder.mkdir(parents=True, exist_ok=True)
        self.log.write_text("")
        failed = next((before for before in self.before if not before["ok"]), None)
        if failed and self.name not in TAKE_ON:
            record.write(self.folder, self.name, {**failed, "products": [], "facts": {}})
            return 0
        try:
            products, facts = self.make()
        except Fault as fault:
            machine = fault.code not in DATA_FAULTS
            if fault.code in STOPPED or (machine and self.options.attempt < self.options.attempts):
                print(f"{self.options.participant} {self.name}: {fault.said['what']} (exit {fault.code}), attempt {self.options.attempt} of "
                      f"{self.options.attempts}", file=sys.stderr)
                return fault.code
            self.remember()
            record.write(self.folder, self.name, {"ok": False, "step": self.name, "fault": "machine" if machine else "data",
                                                  "error": {**fault.said, "exit_code": fault.code}, "products": [], "facts": {}})
            return 0
        self.remember()
        record.write(self.folder, self.name, {"ok": True, "step": self.name, "fault": None, "error": None,
                                              "products": record.products(self.folder, products), "facts": facts})
        return 0

    def make(self):
        """(products, facts) of the step. Whatever goes wrong here itself is the machine's fault: a full disk, a bug."""
        try:
            return STEPS[self.name.split("-")[0]](self)
        except OSError as error:
            raise Fault(74, {"kind": "io", "where": str(error.filename or self.name), "what": error.strerror or str(error),
                             "mend": "check the disk's free space"}) from error
        except (ValueError, KeyError, TypeError) as error:
            raise Fault(70, {"kind": "internal", "where": self.name, "what": f"{type(error).__name__}: {error}", "mend": "this is a bug: report it"}) from error

    def remember(self):
        """Times are measured, not made: they stand apart from what is the same in every run."""
        record.write_text(self.folder / "log" / f"{self.name}.time.json", json.dumps(
            {"seconds": round(self.seconds, 3), "peak_mib": round(self.peak_mib, 1), "attempt": self.options.attempt}) + "\n")

    def call(self, *words, threads=None):
        """The JSON that a command prints. Throws Fault where it ends with anything but 0; `said` is then its one clear error. Threads may
        call side by side."""
        if self.stopped:
            raise Fault(143, {"kind": "internal", "where": self.name, "what": "stopped", "mend": "run again: it goes on where it was"})
        command = [self.options.ecorche, "--json", "--threads", str(threads or self.options.threads), *map(str, words)]
        with open(self.log, "a") as log:
            print("$ " + " ".join(command[:1] + command[4:]), file=log, flush=True)
            start = time.monotonic()
            child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, preexec_fn=end_with_parent, cwd=self.folder)
            self.children.add(child.pid)
            if self.stopped:
                child.terminate()
            threading.Thread(target=self.hold, args=(child.pid,), daemon=True).start()
            with child.stdout:
                printed = child.stdout.read()
            _, status, usage = os.wait4(child.pid, 0)
            self.children.discard(child.pid)
        self.seconds += time.monotonic() - start
        self.peak_mib = max(self.peak_mib, usage.ru_maxrss / 1024)
        code = os.waitstatus_to_exitcode(status)
        code = 128 - code if code < 0 else code
        try:
            found = json.loads(printed)
        except ValueError:
            found = {}
        if code != 0:
            raise Fault(code, self.said(code, found))
        return found

    def hold(self, pid):
        """Kills what holds more memory than was planned, so that a wrong plan harms this step and no other. Looked at, as Slurm does: limits
        of the system count what is reserved, too, and libraries wait for ever where they may not reserve."""
        page = os.sysconf("SC_PAGE_SIZE")
        while self.options.mib > 0:
            try:
                with open(f"/proc/{pid}/statm") as statm:
                    held = int(statm.read().split()[1]) * page >> 20
            except (OSError, IndexError):
                return
            if held > self.options.mib:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
                return
            time.sleep(0.05)

    def said(self, code, found):
        if "error" in found:
            return {key: found["error"].get(key, "") for key in ("kind", "where", "what", "mend")}
        for finding in found.get("findings", []):
            if finding["severity"] == "error":
                return {"kind": "data", "where": finding["where"], "what": finding["what"], "mend": finding["mend"]}
        lines = self.log.read_text(errors="replace").splitlines()
        faults = [line for line in lines if line.startswith("fault: ")]
        if faults:
            return {"kind": "data", "where": "model.hdf", "what": faults[0][len("fault: "):], "mend": "remove the file and run again"}
        if code in (134, 137, 139):
            what = {134: "aborted", 137: "killed, mostly for want of memory", 139: "crashed"}[code]
            return {"kind": "internal", "where": self.name, "what": what, "mend": f"see log/{self.name}.log"}
        return {"kind": "internal", "where": self.name, "what": lines[-1] if lines else f"ended with {code}", "mend": f"see log/{self.name}.log"}

    def data_words(self):
        return ["--data", self.given["data"]] if self.given.get("data") else []

    def keep(self, name, found):
        record.write_text(self.folder / name, json.dumps(found, indent=1, sort_keys=True) + "\n")

    def fresh(self, *names):
        """What an earlier run left under these names."""
        for name in names:
            path = self.folder / name
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)


def new(step):
    step.fresh("case", "scan.html")
    step.call("new", *step.given["files"], "-o", "case", "--report", "scan.html")
    return ["case", "scan.html"], {"case": "case"}


def check(step):
    """An error that check finds is a fact, not an end, where repair may come."""
    import participants
    case = step.given["files"][0] if step.given["is_case"] else step.fact("case")
    inputs = participants.Participant(step.options.participant, [pathlib.Path(path) for path in step.given["files"]], [], step.given.get("data", "")).files()
    step.fresh("check.json")
    facts = {"case": case, "sound": True, "inputs": record.digests(inputs, step.given["root"])}
    try:
        found = step.call("check", case, *step.data_words())
    except Fault as fault:
        if fault.code != 65 or not step.given["repair"]:
            step.keep("check.json", {"ok": False, "error": {**fault.said, "exit_code": fault.code}})
            raise
        found, facts["sound"] = {"ok": False, "error": {**fault.said, "exit_code": fault.code}}, False
    step.keep("check.json", found)
    return ["check.json"], facts


def repair(step):
    case, allowed = step.fact("case"), step.given["repair"]
    step.fresh("mended", "repair.json")
    if step.fact("sound") or not allowed:
        return [], {"case": case}
    step.keep("repair.json", step.call("repair", case, "-o", "mended", *step.given["words"], *step.data_words()))
    step.call("check", "mended", *step.data_words())
    return ["mended", "repair.json"], {"case": "mended"}


def preprocess(step):
    step.fresh("model.hdf", "preprocess.json", "model.refused.vtu")
    found = step.call("preprocess", step.fact("case"), "-o", "model.hdf", *step.given["words"],
                      "--cache", f"{step.options.out}/.cohort/cache/{step.options.participant}", "--cache-gib", step.given["cache_gib"])
    stages = found.pop("stages")
    found.pop("peak_rss_mib")  # measured
    record.write_text(step.folder / "log" / "stages.json", json.dumps(stages) + "\n")
    warnings = [line[len("warning: "):] for line in step.log.read_text(errors="replace").splitlines() if line.startswith("warning: ")]
    step.keep("preprocess.json", {**found, "warnings": warnings})
    return ["model.hdf", "preprocess.json"], {}


def verify(step):
    step.fresh("verify.json")
    step.keep("verify.json", step.call("verify", "model.hdf"))
    return ["verify.json"], {}


def pose(step):
    name = step.name.partition("-")[2]
    target = f"posed/{name}"
    step.fresh(target)
    (step.folder / "posed").mkdir(exist_ok=True)
    try:
        step.call("pose", "model.hdf", "-o", target, *step.given["words"])
    except Fault as fault:
        if not fault.said["what"].startswith(NOT_ITS_POSE):
            raise
        return [], {"left_out": f"{fault.said['where']}: {fault.said['what']}"}
    return [target], {}


def sample(step):
    import samples
    return samples.make(step)


def subject(step):
    """The participant's own results: figures, quality of all poses, digests, and a page."""
    import summary
    keep = {name.partition("-")[2] for name in step.given["after"] if name.startswith("pose-")}
    posed = step.folder / "posed"
    step.fresh(*(f"posed/{path.name}" for path in (posed.iterdir() if posed.is_dir() else []) if path.name not in keep), "report.html", "picture.png")
    found = summary.of(step.folder, step.options.participant, step.given["after"], step.before)
    record.write_text(step.folder / "quality.tsv", summary.quality_table(found["poses"]))
    step.keep("provenance.json", {"ecorche": step.given["program"], "options": step.given["options"],
                                  "inputs": next((before["facts"]["inputs"] for before in step.before if "inputs" in before["facts"]), {}),
                                  "model_sha256": record.sha256(step.folder / "model.hdf") if found["ok"] else None})
    step.keep("status.json", found)
    step.call("report", "participant", step.folder)
    return ["status.json", "quality.tsv", "provenance.json", "report.html", *(["picture.png"] if found["ok"] else [])], {}


STEPS = {"new": new, "check": check, "repair": repair, "preprocess": preprocess, "verify": verify, "pose": pose, "sample": sample, "subject": subject}
TAKE_ON = {"subject"}  # tells of what failed instead of passing it on


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("step")
    parser.add_argument("participant")
    parser.add_argument("--out", required=True)
    parser.add_argument("--ecorche", required=True)
    parser.add_argument("--given", required=True, help="what the step depends on, as JSON")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--mib", type=int, default=0, help="the most memory; 0: no limit")
    parser.add_argument("--attempt", type=int, default=1)
    parser.add_argument("--attempts", type=int, default=1)
    return Step(parser.parse_args()).run()


if __name__ == "__main__":
    sys.exit(main())
