#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Streams a swaying body through the Python client and holds every frame against a plain double-precision oracle.

    ECORCHE_BIN=.../ecorche ECORCHE_MODEL=model.hdf python_stream.py [--seconds 2] [--rate 60]

Exits 1 when a vertex is farther than 0.05 mm from where it should be, or a frame is missing.
"""
import argparse
import os
import sys
import time

import numpy as np

from body_oracle import Body
from ecorche.v1 import common_pb2
from ecorche_client import Client
from serving import Server

TOLERANCE_MM = 0.05
METHODS = {"cor": common_pb2.SKINNING_COR, "dqs": common_pb2.SKINNING_DQS, "lbs": common_pb2.SKINNING_LBS}
RUNS = [("cor", "f32"), ("dqs", "f32"), ("lbs", "f32"), ("cor", "u16"), ("cor", "u16-delta")]


def stream(client, oracle, method, seconds, rate):
    """Plays `seconds` of swaying; returns the frames with their poses, and latencies in ms."""
    sent, frames, latencies = {}, [], []
    start = time.monotonic()
    count = int(seconds * rate)
    for i in range(count):
        pose = oracle.swaying_pose(2 * np.pi * i / rate)
        shift = np.array([3.0, -2.0, 5.0]) * np.sin(i / rate)
        sent[client.send_pose(pose, shift, METHODS[method])] = (pose, shift, time.monotonic())
        # The last one is waited for; the others keep the pace.
        until = start + (i + 1) / rate + (10 if i == count - 1 else 0)
        for frame in client.frames(max(0.0, until - time.monotonic())):
            if frame.pose_sequence in sent:  # not the present pose, which a subscription starts with
                latencies.append(1000 * (time.monotonic() - sent[frame.pose_sequence][2]))
                frames.append((frame, *sent[frame.pose_sequence][:2]))
            if frame.pose_sequence == max(sent) and i == count - 1:
                break
    return frames, latencies, time.monotonic() - start


def worst_error(oracle, frames, method):
    worst = 0.0
    for frame, pose, shift in frames:
        expected = oracle.pose(pose, shift, method)
        if set(expected) != set(frame.positions):
            return np.inf
        for name, positions in frame.positions.items():
            if positions.shape != expected[name].shape:
                return np.inf
            # Half a step is the encoding's own.
            worst = max(worst, float(np.abs(positions - expected[name]).max()) - frame.message.box.step / 2)
    return worst


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--seconds", type=float, default=1.0)
    options.add_argument("--rate", type=float, default=60.0)
    options = options.parse_args()
    model = os.environ["ECORCHE_MODEL"]
    oracle = Body(model)
    bad = False
    print("method  encoding   frames  per second   p50 ms   p99 ms   worst error mm")
    with Server(model) as server:
        for method, encoding in RUNS:
            with Client("127.0.0.1", server.port) as client:
                client.open()
                client.subscribe_mesh(encoding=encoding)
                frames, latencies, seconds = stream(client, oracle, method, options.seconds, options.rate)
                clamped = sum(len(ack.clamped) for ack in client.acks)
                skipped = sum(ack.skipped for ack in client.acks)
                refused = [ack.status.message for ack in client.acks if ack.status.code]
            worst = worst_error(oracle, frames, method)
            told = len({ack.sequence for ack in client.acks}) + skipped
            print(f"{method:6}  {encoding:9} {len(frames):7} {len(frames) / seconds:11.1f} {np.percentile(latencies, 50):8.2f} "
                  f"{np.percentile(latencies, 99):8.2f} {worst:16.2e}")
            problems = []
            if worst > TOLERANCE_MM:
                problems.append(f"a vertex is {worst} mm off")
            if clamped:
                problems.append(f"{clamped} joints were clamped in poses that they can do")
            if refused:
                problems.append(refused[0])
            # Every pose is answered: taken up, or told as skipped.
            if told != int(options.seconds * options.rate):
                problems.append(f"{told} poses were answered for, {int(options.seconds * options.rate)} sent")
            for problem in problems:
                print(f"{method}: {problem}")
            bad = bad or bool(problems)
        code, _, err = server.stop()
        if code != 0:
            print(f"the server ended with {code}: {err}")
            bad = True
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
