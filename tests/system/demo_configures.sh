#!/usr/bin/env bash
# demo_configures.sh SOURCES: configures as scripts/demo does. Hides the packages that scripts/packages.txt has in other sets than
# `run`. Checks that the programs of the demo are among the targets, and that the others are not.
set -euo pipefail
sources=$1
build=$(mktemp -d)
trap 'rm -rf "$build"' EXIT
cmake -S "$sources" -B "$build" -G Ninja -DKILOTWIN_TESTS=OFF -DCMAKE_BUILD_TYPE=Release -DCMAKE_IGNORE_PATH=/usr/include/opencv4 \
  -DCMAKE_DISABLE_FIND_PACKAGE_Boost=ON -DCMAKE_DISABLE_FIND_PACKAGE_pagmo=ON -DCMAKE_DISABLE_FIND_PACKAGE_GTest=ON >"$build/log" 2>&1 ||
  { tail -n 20 "$build/log"; exit 1; }
targets=$(ninja -C "$build" -t targets all)
for name in kilotwin kilotwin-view; do
  grep -q "^$name: " <<<"$targets" || { echo "no target $name"; exit 1; }
done
# Without Boost's headers this library does not compile.
! grep -q libkilotwin_stats <<<"$(ninja -C "$build" -t inputs kilotwin)" || { echo "target kilotwin needs Boost"; exit 1; }
for name in kilotwin-identify kilotwin-vision kilotwin-tune; do
  ! grep -q "^$name: " <<<"$targets" || { echo "target $name needs a package that scripts/demo does not install"; exit 1; }
done
