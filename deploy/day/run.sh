#!/bin/sh
# run LEG OUT: one leg of a day on a GPU, its results to OUT/LEG/. Without words, what there is.
set -e
here=$(cd "$(dirname "$0")" && pwd)
# Named last by the unpacking, so that one which was interrupted is begun anew.
if [ ! -d "$here/bundle" ]; then
  rm -rf "$here/bundle.part"
  mkdir "$here/bundle.part"
  "$here/busybox" tar -xJf "$here/payload.tar.xz" -C "$here/bundle.part"
  mv "$here/bundle.part" "$here/bundle"
fi
exec "$here/bundle/bin/python3" "$here/bundle/day/run.py" "$@"
