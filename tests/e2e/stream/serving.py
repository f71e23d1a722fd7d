# SPDX-License-Identifier: Apache-2.0
"""`ecorche serve` as a context: on a free port, stopped by SIGTERM."""
import os
import pathlib
import signal
import subprocess
import tempfile
import time

ECORCHE = os.environ["ECORCHE_BIN"]


class Server:
    def __init__(self, *models, options=(), host="127.0.0.1", port=0):
        self._folder = tempfile.TemporaryDirectory()
        port_file = pathlib.Path(self._folder.name) / "port"
        self.process = subprocess.Popen(
            [ECORCHE, "serve", *map(str, models), "--listen", f"{host}:{port}", "--port-file", str(port_file), *options],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 60
        while not port_file.exists():
            if self.process.poll() is not None or time.monotonic() > deadline:
                self.process.kill()
                raise RuntimeError("ecorche serve did not start: " + self.process.communicate()[1])
            time.sleep(0.01)
        ports = [int(line) for line in port_file.read_text().split()]
        self.port, self.http_port = ports[0], (ports[1:] or [None])[0]
        self.address = f"{host}:{self.port}"

    def __enter__(self):
        return self

    def stop(self):
        """SIGTERM; returns the exit code and what was printed."""
        self.process.send_signal(signal.SIGTERM)
        out, err = self.process.communicate(timeout=30)
        return self.process.returncode, out, err

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.stop()
        self.process.stdout.close()
        self.process.stderr.close()
        self._folder.cleanup()
