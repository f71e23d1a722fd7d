# SPDX-License-Identifier: Apache-2.0
"""Steps as forks of one Python that has its modules already: two milliseconds each, where a Python of its own takes fifty.

Each is a process still, and none of Snakemake's own threads: signals are handled in main threads alone, and what a process is said to have
held at most is never less than what its parent held, which of Snakemake is more than many a step takes.
"""
import atexit
import contextlib
import ctypes
import gc
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import threading
import traceback
import types

STOPS = (signal.SIGINT, signal.SIGTERM)
KILLED, STOPPED = 137, 143


class StepForks:
    """Snakemake's side; threads may call side by side."""

    def __init__(self):
        self.guard, self.process, self.control = threading.Lock(), None, None
        atexit.register(self.end)

    def run(self, **options):
        """The exit code of the step that has these options (those of step.py)."""
        ours, theirs = socket.socketpair()
        with ours:
            with theirs, self.guard:
                socket.send_fds(self.server(), [b"step"], [theirs.fileno()])
            try:
                ours.sendall(json.dumps(options).encode())
                ours.shutdown(socket.SHUT_WR)
                code = ours.recv(16)
            except OSError:  # its other end is gone
                code = b""
        return int(code) if code else KILLED

    def server(self):
        """Started by the first step, and once more where somebody killed it. It ends when its other end of the socket is closed."""
        if self.process is None or self.process.poll() is not None:
            self.control, theirs = socket.socketpair()
            with theirs:
                self.process = subprocess.Popen([sys.executable, __file__, str(theirs.fileno())], stdin=subprocess.DEVNULL, pass_fds=[theirs.fileno()])
        return self.control

    def end(self):
        if self.process is not None:
            self.control.close()
            self.process.wait()


class Server:
    def __init__(self, control):
        self.control, self.stopped = control, False
        for which in STOPS:  # a stop reaches the steps as well, and Snakemake ends this
            signal.signal(which, self.stop)
        signal.signal(signal.SIGCHLD, self.reap)

    def stop(self, *_):
        self.stopped = True

    def reap(self, *_):
        """Not left to the system, which would forget what time they took."""
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass

    def serve(self):
        import participants  # noqa: F401  what single steps would import
        import samples  # noqa: F401
        import step
        import summary  # noqa: F401
        libc = ctypes.CDLL(None)
        gc.freeze()  # a collection in a fork would copy every page
        while True:
            message, received, _, _ = socket.recv_fds(self.control, 16, 1)
            if not message:
                return
            with socket.socket(fileno=received[0]) as link:
                # A stop that comes while it is forked reaches this process alone: it is told of it.
                signal.pthread_sigmask(signal.SIG_BLOCK, STOPS)
                fork = None if self.stopped else os.fork()
                if fork == 0:
                    libc.prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG
                    self.control.close()
                    become(step, link)
                signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPS)
                if fork is None:
                    link.sendall(str(STOPPED).encode())
                elif self.stopped:
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(fork, signal.SIGTERM)


def become(step, link):
    """The step. Never returns."""
    code = 1
    try:
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        with link.makefile("rb") as asked:
            options = json.loads(asked.read())
        one = step.Step(types.SimpleNamespace(**options))
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPS)
        code = one.run()
        link.sendall(str(code).encode())
    except BaseException:  # whatever it is, this process ends here
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
    Server(socket.socket(fileno=int(sys.argv[1]))).serve()
