#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What deploy/ has for Prometheus and Grafana speaks of metrics and labels that a server has, and all of them are spoken of.

usage: monitoring_test.py SOURCE [Promtool]; the environment is that of the fixtures. Promtool: what asks Debian's package prometheus
"""
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest
import urllib.request

import yaml
from ecorche_client import Client
from serving import Server

SOURCE = pathlib.Path(sys.argv[1])
DEPLOY = SOURCE / "deploy"
RULES = DEPLOY / "ecorche.rules.yml"
MODEL = os.environ["ECORCHE_BAR_MODEL"]
# A histogram's own.
SUFFIXES = re.compile(r"_(bucket|sum|count)$")


def alerts():
    return [rule for group in yaml.safe_load(RULES.read_text())["groups"] for rule in group["rules"]]


def dashboard():
    return json.loads((DEPLOY / "grafana.json").read_text())


def expressions():
    shown = [target["expr"] for panel in dashboard()["panels"] for target in panel["targets"]]
    asked = [one["query"]["query"] for one in dashboard()["templating"]["list"] if one["type"] == "query"]
    return [rule["expr"] for rule in alerts()] + shown + asked


def metrics_page():
    """Of a server that has posed, and one of whose limits was hit."""
    with Server(MODEL, options=("--http", "127.0.0.1:0")) as server, Client("127.0.0.1", server.port) as client:
        body = client.open()
        client.subscribe_mesh()
        client.send_pose(body.rest_pose())
        next(frame for frame in client.frames(seconds=20) if frame.pose_sequence == 1)
        with socket.create_connection(("127.0.0.1", server.port), 5) as no_client:
            no_client.sendall(b"\xff" * 64)
            while no_client.recv(4096):
                pass
        with urllib.request.urlopen(f"http://127.0.0.1:{server.http_port}/metrics") as answer:
            return answer.read().decode()


class Monitoring(unittest.TestCase):
    def test_every_metric_is_there_and_every_one_is_shown(self):
        page = metrics_page()
        there = set(re.findall(r"^# TYPE (\w+)", page, re.M))
        self.assertGreater(len(there), 8)
        named = {SUFFIXES.sub("", name) for text in expressions() for name in re.findall(r"\becorche_\w+", text)}
        self.assertEqual(named - there, set(), "no server has these")
        self.assertEqual(there - named, set(), "nobody looks at these")
        listed = set(re.findall(r"`(ecorche_\w+)", (SOURCE / "docs/operations.md").read_text()))
        self.assertEqual(listed, there, "docs/operations.md lists them")
        stages = set(re.findall(r'stage="(\w+)"', page))
        asked = {stage for text in expressions() for some in re.findall(r'stage=~?"([\w|]+)"', text) for stage in some.split("|")}
        self.assertEqual(asked, stages)

    def test_the_dashboard_can_be_drawn(self):
        board = dashboard()
        ids = [panel["id"] for panel in board["panels"]]
        self.assertEqual(len(ids), len(set(ids)))
        taken = set()
        for panel in board["panels"]:
            place = panel["gridPos"]
            cells = {(x, y) for x in range(place["x"], place["x"] + place["w"]) for y in range(place["y"], place["y"] + place["h"])}
            self.assertFalse(cells & taken, f"{panel['title']} lies on another panel")
            self.assertLessEqual(max(x for x, _ in cells), 23, panel["title"])
            taken |= cells
        for text in expressions():
            self.assertLessEqual(set(re.findall(r"\$(\w+)", text)), {"instance", "labels", "value"}, text)


class Promtool(unittest.TestCase):
    def test_syntax_types_and_what_each_alert_is_about(self):
        promtool = shutil.which("promtool")
        self.assertTrue(promtool, "it is not installed (scripts/setup --all)")
        with tempfile.TemporaryDirectory() as folder:
            for path in (RULES, DEPLOY / "prometheus.yml", SOURCE / "tests/e2e/fleet/alerts_test.yml"):
                shutil.copy(path, folder)
            # The dashboard's, too: as rules, without Grafana's variables.
            rules = [{"record": f"panel:{i}", "expr": text.replace("$instance", ".*")} for i, text in enumerate(expressions()) if "label_values" not in text]
            (pathlib.Path(folder) / "panels.yml").write_text(json.dumps({"groups": [{"name": "panels", "rules": rules}]}))
            for words in (("check", "rules", "ecorche.rules.yml"), ("check", "rules", "panels.yml"), ("check", "config", "--syntax-only", "prometheus.yml"),
                          ("test", "rules", "alerts_test.yml")):
                done = subprocess.run([promtool, *words], cwd=folder, capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *(sys.argv[2:] or ["Monitoring"])])
