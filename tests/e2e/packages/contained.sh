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
    ! $INSIDE sh -c "command -v cc || command -v c++ || command -v cmake" || { echo "error: there is a compiler" >&2; exit 70; }
    # The network is this script's, too.
    python3 -c 'import urllib.request; assert b"<title>" in urllib.request.urlopen("http://127.0.0.1:7071/").read(), "no viewer"'
    echo "sick before, healthy then, no compiler, a viewer"
    exit
  fi
  sleep 0.5
done
exit 70
