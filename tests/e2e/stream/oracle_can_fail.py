#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The check of python_stream can fail: an oracle that forgets one weight finds the frames wrong."""
import os
import sys

from body_oracle import Body
from ecorche_client import Client
from python_stream import TOLERANCE_MM, stream, worst_error
from serving import Server


def main():
    model = os.environ["ECORCHE_MODEL"]
    oracle = Body(model)
    with Server(model) as server, Client("127.0.0.1", server.port) as client:
        client.open()
        client.subscribe_mesh()
        frames = stream(client, oracle, "cor", 0.2, 30)[0]
    good = worst_error(oracle, frames, "cor")
    # The heaviest segment takes a hundredth from all others.
    oracle.weights *= 0.99
    oracle.weights[range(len(oracle.weights)), oracle.weights.argmax(1)] += 0.01
    spoilt = worst_error(oracle, frames, "cor")
    print(f"worst error {good:.2e} mm, with spoilt weights {spoilt:.2e} mm")
    return 0 if good <= TOLERANCE_MM < spoilt else 1


if __name__ == "__main__":
    sys.exit(main())
