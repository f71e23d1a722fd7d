# SPDX-License-Identifier: Apache-2.0
"""Two network namespaces and a slow line between them: the kernel's own TCP at both ends, packets that take their time, wait and
are lost between. As netem does, which few kernels have; this asks for TUN devices and for root."""
import collections
import contextlib
import ctypes
import fcntl
import os
import random
import select
import struct
import subprocess
import sys
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 1, 0x1000
CLONE_NEWNET = 0x40000000
QUEUE = 1000  # packets on their way in one direction; what comes then is lost, too
NEAR, FAR = "10.77.0.1", "10.77.0.2"


def run(*words):
    subprocess.run(words, check=True, capture_output=True, text=True)


class SlowLink:
    """`near` and `far` are namespaces, in which NEAR and FAR are addresses. Each way: `rate` in bit/s, `delay` in seconds, `loss`
    as a share of packets. `congestion`: how TCP meets that where nothing else is asked for. Raises OSError or CalledProcessError
    where the system does not let us."""

    def __init__(self, rate=100e6, delay=0.025, loss=0.01, congestion="reno"):
        self.near, self.far = (f"ecorche-{end}-{os.getpid()}" for end in ("near", "far"))
        self._cleanup, self._congestion = contextlib.ExitStack(), congestion
        try:
            ends = [self._end(self.near, NEAR), self._end(self.far, FAR)]
            words = [sys.executable, __file__, *map(str, [*ends, rate, delay, loss])]
            carrier = subprocess.Popen(words, pass_fds=ends)
            self._cleanup.callback(carrier.wait)
            self._cleanup.callback(carrier.kill)
        except BaseException:
            self._cleanup.close()
            raise

    def _end(self, space, address):
        run("ip", "netns", "add", space)
        self._cleanup.callback(run, "ip", "netns", "del", space)
        device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        self._cleanup.callback(os.close, device)
        name = "ec" + space.split("-")[1]
        fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH", name.encode(), IFF_TUN | IFF_NO_PI))
        run("ip", "link", "set", name, "netns", space)
        run("ip", "netns", "exec", space, "sh", "-c", f"echo {self._congestion} > /proc/sys/net/ipv4/tcp_congestion_control")
        for words in (["addr", "add", address + "/30", "dev", name], ["link", "set", name, "up"], ["link", "set", "lo", "up"]):
            run("ip", "-n", space, *words)
        return device

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._cleanup.close()

    @contextlib.contextmanager
    def at(self, space):
        """Sockets that this thread makes are of that namespace."""
        libc = ctypes.CDLL(None, use_errno=True)
        with open("/proc/thread-self/ns/net") as home, open(f"/run/netns/{space}") as there:
            if libc.setns(there.fileno(), CLONE_NEWNET) != 0:
                raise OSError(ctypes.get_errno(), "setns")
            try:
                yield
            finally:
                libc.setns(home.fileno(), CLONE_NEWNET)


def carry(ends, rate, delay, loss):
    """Packets from either end to the other, until killed."""
    lost = random.Random(1)
    ways = {ends[0]: (ends[1], collections.deque()), ends[1]: (ends[0], collections.deque())}
    free = dict.fromkeys(ends, 0.0)  # when the line has sent what it was given
    while True:
        due = [queue[0][0] for _, queue in ways.values() if queue]
        readable, _, _ = select.select(ends, [], [], max(0.0, min(due) - time.monotonic()) if due else None)
        for end in readable:
            queue = ways[end][1]
            with contextlib.suppress(BlockingIOError):
                while True:
                    packet = os.read(end, 65536)
                    if len(queue) >= QUEUE or lost.random() < loss:
                        continue
                    free[end] = max(free[end], time.monotonic()) + 8 * len(packet) / rate
                    queue.append((free[end] + delay, packet))
        for to, queue in ways.values():
            while queue and queue[0][0] <= time.monotonic():
                with contextlib.suppress(BlockingIOError):
                    os.write(to, queue.popleft()[1])


if __name__ == "__main__":
    carry([int(word) for word in sys.argv[1:3]], *map(float, sys.argv[3:6]))
