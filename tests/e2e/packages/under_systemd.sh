#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The units of the package under a systemd that has just begun to start; run by packages_test.py.
set -eu
fail() { echo "error: $1" >&2; systemctl status ecorche.service --no-pager --lines 40 >&2 || true; exit 70; }
for _ in $(seq 300); do
  ! systemctl is-system-running 2>/dev/null | grep -qE 'running|degraded' || break
  sleep 0.2
done
ip link set lo up
is() { [ "$(systemctl show --value --property "$1" ecorche.service)" = "$2" ] || fail "$1 is not $2"; }

# The service: ready when `start` comes back, and again when `reload` does.
systemctl start ecorche.service
is ActiveState active
is StatusText "listening on 127.0.0.1:7070"
process=$(systemctl show --value --property MainPID ecorche.service)
grep -q '^CapEff:[[:space:]]*0000000000000000$' "/proc/$process/status" || fail "it has capabilities"
grep -q '^NoNewPrivs:[[:space:]]*1$' "/proc/$process/status" || fail "it may win privileges"
[ "$(awk '/^Uid:/ {print $2}' "/proc/$process/status")" -ge 61184 ] || fail "its user is not made for it"
systemctl reload ecorche.service
sleep 1
is ActiveState active
is MainPID "$process"
journalctl --unit ecorche.service | grep -q 'model patient: read again' || fail "the model was not read again"
systemctl stop ecorche.service
is Result success

# The ports: nobody serves until somebody comes.
systemctl start ecorche.socket
is ActiveState inactive
python3 - <<'PY'
import ecorche
with ecorche.connect("127.0.0.1:7070") as client:
    client.show(client.set("elbow_left", flexion=60).send())
    assert len(client.positions("skin")) > 1000
PY
is ActiveState active
echo "all is well"
