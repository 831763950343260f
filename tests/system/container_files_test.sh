#!/usr/bin/env bash
# usage: container_files_test.sh SOURCES
# Both container files install without recommended packages. So they name all that the Debian package recommends or suggests.
set -euo pipefail
package=$1/deploy/package
mapfile -t wanted < <(sed -nE 's/^set\(CPACK_DEBIAN_PACKAGE_(RECOMMENDS|SUGGESTS) "(.*)"\)$/\2/p' "$1/cmake/Package.cmake" | tr -s ', ' '\n')
[ "${#wanted[@]}" -ge 10 ] || { echo "FAILED: cmake/Package.cmake names only ${#wanted[@]} packages"; exit 1; }
for file in "$package/Containerfile" "$package/kilotwin.apptainer.def"; do
  # The words of the command that installs, with the lines that continue it.
  named=$(sed -e ':a' -e '/\\$/{N;s/\\\n//;ba' -e '}' "$file" | grep -- --no-install-recommends | tr -s ' ' '\n')
  for name in "${wanted[@]}"; do
    grep -qxF -- "$name" <<<"$named" || { echo "FAILED: $file does not install $name"; exit 1; }
  done
done
echo "${#wanted[@]} packages are named in both files"
