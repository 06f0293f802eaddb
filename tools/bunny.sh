#!/bin/sh
# Fetches a bunny to fit coats to: `bunny.sh FILE.obj`. It comes with the Python package pybullet, as a wheel or, where
# there is none for this Python, with its sources (80 MB).
set -eu
file=$1
command -v python3 >/dev/null || { echo "python3 is missing: its pip fetches the bunny." >&2; exit 1; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
echo "Fetching: pybullet, with pip, for its bunny.obj"
python3 -m pip download --quiet --no-deps --dest "$folder" pybullet >"$folder/log" 2>&1 || {
    tail -n 5 "$folder/log" >&2
    echo "pip could not download pybullet. Any closed OBJ of triangles will do: make fit BUNNY=FILE.obj" >&2
    exit 1
}
mkdir -p "$(dirname "$file")"
python3 - "$folder" "$file" <<'PYTHON'
import pathlib, sys, tarfile, zipfile

name = "pybullet_data/bunny.obj"
for package in pathlib.Path(sys.argv[1]).glob("pybullet*"):
    if package.suffix == ".whl":
        archive = zipfile.ZipFile(package)
        found, read = archive.namelist(), archive.read
    else:
        archive = tarfile.open(package)
        found, read = archive.getnames(), lambda member: archive.extractfile(member).read()
    for member in found:
        if member.endswith(name):
            pathlib.Path(sys.argv[2]).write_bytes(read(member))
            sys.exit()
sys.exit(f"pybullet has no {name}")
PYTHON
