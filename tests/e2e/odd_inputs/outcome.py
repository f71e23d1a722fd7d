# SPDX-License-Identifier: Apache-2.0
"""What may come of an odd input: prepared, with a verdict that is true, or refused for a reason."""
import dataclasses
import json
import os
import re
import subprocess


@dataclasses.dataclass
class Refused:
    """With this exit code and one error line that holds `part`; where `mended`, the command that it advises mends the case."""
    code: int
    part: str
    mended: bool = False


@dataclasses.dataclass
class Prepared:
    """To a model; posed, with this verdict (any where None), all `said` among what was told on the way."""
    verdict: str = None
    said: tuple = ()
    pose: str = "own"  # None: not posed


LINE = re.compile(r"^error: .+: .+ \(.+\)$", re.M)
ECORCHE = os.environ["ECORCHE_BIN"]


def run(*words):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=300, errors="replace")


def wrong_refusal(done, expected, out):
    """What is wrong with a refusal: its exit code, its line, what it left behind."""
    lines = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    if done.returncode == 0:
        return ["is not refused"]
    problems = []
    if done.returncode != expected.code:
        problems.append(f"exit code {done.returncode}, not {expected.code}: {done.stderr[-300:]}")
    if len(lines) != 1 or not LINE.match(lines[0]) or expected.part not in lines[0]:
        problems.append(f"not one error line with {expected.part!r}: {done.stderr[-300:]}")
    if done.stdout and json.loads(done.stdout).get("ok") is not False:  # --json has the error there, too
        problems.append("a result beside the error")
    if left := sorted(path.name for path in out.iterdir() if not path.name.endswith(".refused.vtu")):
        problems.append(f"leaves {left}")
    return problems
