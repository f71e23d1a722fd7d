#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""running, success or failed: what Slurm says of a job, by scontrol, and by sacct where the controller has forgotten it."""
import re
import subprocess
import sys
import time

RUNNING = {"PENDING", "CONFIGURING", "RUNNING", "COMPLETING", "SUSPENDED", "REQUEUED", "RESIZING", "SIGNALING", "STAGE_OUT", "STOPPED",
           "REQUEUE_HOLD", "REQUEUE_FED", "SPECIAL_EXIT"}


def ask(*words):
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return done.stdout if done.returncode == 0 else None


def state_of(job):
    """None where nobody knows it."""
    for attempt in range(5):
        said = ask("scontrol", "--oneliner", "show", "job", job)
        found = re.search(r"JobState=(\w+)", said or "")
        if found:
            return found[1]
        said = ask("sacct", "--allocations", "--noheader", "--parsable2", "--format=State", "-j", job)
        if said and said.strip():
            return said.split()[0]
        time.sleep(attempt)
    return None


state = state_of(sys.argv[1])
print("success" if state == "COMPLETED" else "running" if state in RUNNING else "failed")
