# SPDX-License-Identifier: Apache-2.0
"""Two servers behind HAProxy, by the configuration that deploy/ has, with this machine's addresses in it."""
import os
import pathlib
import re
import shutil
import socket
import ssl
import subprocess
import tempfile
import time

ECORCHE = os.environ["ECORCHE_BIN"]


def free_ports(count):
    """Ports that nobody has now."""
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def haproxy():
    """The program; it stands in /usr/sbin, which is not on everybody's PATH."""
    return shutil.which("haproxy") or "/usr/sbin/haproxy"


def replaced(text, what, by):
    assert text.count(what) == 1, (what, text.count(what))
    return text.replace(what, by)


def make_certificate(folder):
    """A PEM file of a certificate for this machine, and one of it with its key, as HAProxy reads them."""
    certificate, key, both = (pathlib.Path(folder) / name for name in ("certificate.pem", "key.pem", "both.pem"))
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost", "-addext",
                    "subjectAltName=DNS:localhost,IP:127.0.0.1", "-keyout", key, "-out", certificate], check=True, capture_output=True)
    both.write_text(certificate.read_text() + key.read_text())
    return certificate, key, both


class Node:
    """One server of the fleet, on the same ports however often it is started."""

    def __init__(self, name, model, *options):
        self.name, self.model, self.options = name, model, options
        self.tls = "--tls-key" in options
        self.port, self.http_port = free_ports(2)
        self.process, self.log = None, tempfile.TemporaryFile("w+")

    def start(self):
        self.process = subprocess.Popen(
            [ECORCHE, "serve", str(self.model), "--listen", f"127.0.0.1:{self.port}", "--http", f"127.0.0.1:{self.http_port}",
             "--peer-share", "1", *self.options], stdout=subprocess.DEVNULL, stderr=self.log)
        deadline = time.monotonic() + 60
        while self.ready() != 200:
            assert self.process.poll() is None and time.monotonic() < deadline, f"{self.name} does not serve"
            time.sleep(0.02)
        return self

    def ask(self, target):
        """Status and text of a page; status 0 where nobody answers."""
        try:
            with socket.create_connection(("127.0.0.1", self.http_port), 5) as port:
                with ssl._create_unverified_context().wrap_socket(port) if self.tls else port as line:
                    line.sendall(f"GET {target} HTTP/1.0\r\n\r\n".encode())
                    answer = b"".join(iter(lambda: line.recv(65536), b"")).decode()
        except OSError:
            return 0, ""
        return int(answer.split()[1]) if answer else 0, answer

    def ready(self):
        return self.ask("/readyz")[0]

    def clients(self):
        found = re.search(r"^ecorche_clients (\d+)", self.ask("/metrics")[1], re.M)
        return int(found[1]) if found else 0

    def stop(self, signal):
        self.process.send_signal(signal)
        return self.process.wait(timeout=60)

    def close(self):
        if self.process and self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.log.close()


def let_through(text):
    accept, balance, stick = (line for line in text.splitlines() if line.startswith(("    tcp-request content accept", "    balance hash req.payload", "    stick on req.payload")))
    for old, new in ((accept, "    tcp-request content accept if { req.ssl_hello_type 1 }"), (balance, "    balance hash req.ssl_sni"),
                     (stick, "    stick on req.ssl_sni table sessions")):
        text = replaced(text, old, new)
    text = "\n".join(line for line in text.splitlines() if "set-var(sess" not in line) + "\n"
    return re.sub(r"(server \w .* check port \d+)", r"\1 check-ssl verify none", text)


class Balancer:
    """HAProxy in front of two nodes: deploy/haproxy.cfg, without TLS or with this certificate. `through`: it lets TLS through, as
    docs/how-to/several_servers.md says."""

    def __init__(self, source, nodes, certificate=None, through=False):
        self._folder = tempfile.TemporaryDirectory()
        self.port, self.http_port = free_ports(2)
        text = (pathlib.Path(source) / "deploy" / "haproxy.cfg").read_text()
        tls = " ssl crt /etc/haproxy/ecorche.pem ssl-min-ver TLSv1.2"
        ours = f" ssl crt {certificate} ssl-min-ver TLSv1.2" if certificate else ""
        text = replaced(text, f"bind :7070{tls}", f"bind 127.0.0.1:{self.port}{ours}")
        text = replaced(text, f"bind :443{tls} alpn http/1.1", f"bind 127.0.0.1:{self.http_port}{ours}")
        for node, address in zip(nodes, ("10.0.0.11", "10.0.0.12")):
            row = nodes.index(node) + 1
            text = replaced(text, f"{address}:7070 id {row} check port 7071", f"127.0.0.1:{node.port} id {row} check port {node.http_port}")
            text = replaced(text, f"{address}:7071", f"127.0.0.1:{node.http_port}")
        if through:
            text = let_through(text)
        self.path = pathlib.Path(self._folder.name) / "haproxy.cfg"
        self.path.write_text(text)
        self.log = open(self.path.with_suffix(".log"), "w+")
        self.process = subprocess.Popen([haproxy(), "-db", "-f", self.path], stdout=self.log, stderr=self.log)
        deadline = time.monotonic() + 20
        while True:
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
                break
            except OSError:
                assert self.process.poll() is None and time.monotonic() < deadline, self.text()
                time.sleep(0.02)

    def text(self):
        self.log.flush()
        return pathlib.Path(self.log.name).read_text()

    def close(self):
        self.process.kill()
        self.process.wait()
        self.log.close()
        self._folder.cleanup()
