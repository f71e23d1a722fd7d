#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# From nothing to a served body, by what the packages installed; run by packages_test.py inside of that Debian.
set -eu
for compiler in cc gcc c++ g++ clang clang++ make cmake; do
  ! command -v $compiler || { echo "error: there is $compiler" >&2; exit 70; }
done
cd /tmp
ecorche phantom -o patient --size small
ecorche preprocess patient -o patient.hdf --max-tets 100000
ecorche serve patient.hdf --listen 127.0.0.1:0 --http 127.0.0.1:0 --port-file port >served &
server=$!
until [ -s port ]; do kill -0 $server; sleep 0.1; done
ecorche stream "127.0.0.1:$(head -n 1 port)" --motion patient/motion/walk.bvh --seconds 3 --model patient.hdf
python3 - "127.0.0.1:$(head -n 1 port)" "$(tail -n 1 port)" <<'PY'
import importlib.metadata, sys, urllib.request
import ecorche
with urllib.request.urlopen(f"http://127.0.0.1:{sys.argv[2]}/healthz") as answer:
    assert answer.status == 200
with urllib.request.urlopen(f"http://127.0.0.1:{sys.argv[2]}/") as answer:
    assert b"<title>" in answer.read()
model = ecorche.Model("patient.hdf")
body = model.pose("lib:sitting")
print("posed in process:", len(body.positions("skin")), "vertices of", model, "by", importlib.metadata.version("ecorche"))
with ecorche.connect(sys.argv[1]) as client:
    client.show(client.set("elbow_left", flexion=90).send())
    print("posed by the server:", client.positions("skin").shape)
PY
kill -TERM $server
wait $server
