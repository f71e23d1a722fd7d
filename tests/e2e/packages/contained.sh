#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs the image's command, and its health check, by $INSIDE; run by packages_test.py. usage: contained.sh COMMAND...
set -eu
ip link set lo up
! $INSIDE healthy || { echo "error: healthy without a server" >&2; exit 70; }
$INSIDE "$@" &
for _ in $(seq 120); do
  if $INSIDE healthy; then
    $INSIDE id
    echo "sick before, healthy then"
    exit
  fi
  sleep 0.5
done
exit 70
