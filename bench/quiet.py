# SPDX-License-Identifier: Apache-2.0
"""Whether a machine does nothing but a bench: what others take of its processors, and its hypervisor of it."""
import pathlib
import time

MOST_BUSY = 0.05  # of all processors


def busy(seconds=3.0):
    """The share of all processors' time that was not idle over the next `seconds`, in which the caller does nothing; stolen time counts."""
    before = times()
    time.sleep(seconds)
    idle, whole = (after - first for after, first in zip(times(), before))
    return 1 - idle / max(whole, 1)


def stolen(before):
    """The share of processors' time since `before` (of steals()) that the hypervisor gave to others."""
    took, whole = (after - first for after, first in zip(steals(), before))
    return took / max(whole, 1)


def steals():
    numbers = jiffies()
    return numbers[7], sum(numbers[:8])


def times():
    numbers = jiffies()
    return numbers[3] + numbers[4], sum(numbers[:8])


def jiffies():
    """user, nice, system, idle, iowait, irq, softirq, steal, of all processors since the start: proc(5)."""
    return [int(word) for word in pathlib.Path("/proc/stat").read_text().splitlines()[0].split()[1:]]
