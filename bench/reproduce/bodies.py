# SPDX-License-Identifier: Apache-2.0
"""Six public bodies in one go (bench/bodies): what must be true of each."""
import subprocess
import sys

import programs
from reproduce.rows import Found, Part, Row, UNKNOWN

WALK = "mocap/cmu_31joint/02_01_walk.bvh"
TRUTHS = {1: "certificate, weights, rest pose and rigid bones", 2: "a walk inverts less than 0.1 % of the body", 3: "posed meshes and label volume agree",
          4: "thirty poses come back", 5: "read, checked and prepared in 3 minutes and 8 GiB", 6: "posed as a case, it is prepared again and comes back"}


def truths(printed):
    """(body, truth, holds, found) of the last table that bench/bodies prints."""
    rows = [[cell.strip() for cell in line.strip("| \n").split(" | ")] for line in printed.splitlines() if line.startswith("| ")]
    heads = [i for i, row in enumerate(rows) if row[:2] == ["body", "truth"]]
    if not heads:
        raise SystemExit("error: reproduce: bench/bodies ended without its truths (see above)")
    return [(row[0], int(row[1]), row[2] == "holds", row[3]) for row in rows[heads[-1] + 1:] if len(row) == 4 and row[1].isdigit()]


def skipping(*numbers):
    return [word for number in numbers for word in ("--skip", str(number))]


def bodies(*words):
    def find(kit):
        command = ["bench/bodies/run", "--data", "DATA", "--max-tets", "300000", "--walk", f"DATA/{WALK}", *words]
        real = [str(programs.ROOT / command[0]), *(word.replace("DATA", str(kit.data)) for word in command[1:])]
        # 1: a truth does not hold, which is what its row says.
        done = subprocess.run([*real, *(["knee", "--frames", "0:40:20"] if kit.small else [])], stdout=subprocess.PIPE, text=True)
        sys.stderr.write(done.stdout)
        if done.returncode not in (0, 1):
            raise SystemExit(f"error: reproduce: bench/bodies ended with {done.returncode} (see above)")
        return Found([Row(f"{body}: {TRUTHS[number]}", UNKNOWN, found if holds else f"**does not hold**: {found}", " ".join(command),
                          "" if holds else "A bound of ours, not of the papers.") for body, number, holds, found in truths(done.stdout)])

    return find


PARTS = [
    Part("bodies_prepared", "bodies", "What must be true: prepared", bodies(*skipping(2, 3, 4, 6)), timed=True, needs_data=True),
    Part("bodies", "bodies", "What must be true: all six truths, in one go", bodies(), timed=True, needs_data=True),
]
