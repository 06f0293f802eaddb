"""Measures isocoat beside its peers and writes docs/peers.md.

    run.py PROGRAMS PYTHON

PROGRAMS is the folder of bullet_clusters and coat_spheres, PYTHON an interpreter that has the package drake. What is
missing is said in the page and on the screen, with how to get it; the rest is measured all the same.
"""

import csv
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]

HEAD = """# Beside its peers

Written by `make peers`: each peer and isocoat in turn, within one run, on one thread; medians of processor time. Times
drift by tens of per cent with what else the machine does: the ratios count. *Polar* is isocoat with its closed forms
and facets off: a general scheme against a general scheme. *Default* leaves the scheme to the library.
"""


def rows_of(text):
    """CSV text as dictionaries, numbers as numbers."""
    def number(word):
        try:
            return float(word)
        except ValueError:
            return word
    return [{key: number(value) for key, value in row.items()} for row in csv.DictReader(text.strip().splitlines())]


def run(command):
    """What a program prints; its lines appear on the screen too."""
    # splashsurf, told to use one thread, still has some of its work done by all of the pool's.
    alone = {**os.environ, "RAYON_NUM_THREADS": "1"}
    process = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, text=True, env=alone)
    lines = []
    for line in process.stdout:
        print("  " + line, end="", flush=True)
        lines.append(line)
    if process.wait() != 0:
        raise SystemExit(f"{command[0]} failed")
    return "".join(lines)


def digits(x):
    return f"{x:.3g}" if x < 1000 else f"{x:.0f}"


def percent(x):
    if x < 1e-5:
        return f"{x:.0e}"
    return f"{100 * x:.2g}%"


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(str(cell) for cell in line) + " |\n" for line in lines)


def verdict(met):
    return "met" if met else "**missed**"


def bullet(programs):
    """The section on Bullet, and its rows of bars."""
    title = "\n## A pile of soft balls: Bullet's clusters\n\n"
    program = programs / "bullet_clusters"
    if not program.exists():
        return title + ("Not measured: Bullet (the Debian package libbullet-dev), a C++ compiler or pkg-config is missing; "
                        "`make deps` fetches them.\n"), []
    print("Bullet:", flush=True)
    rows = rows_of(run([program]))
    text = title + (
        "Balls of 0.5 m and 1 kg in a pit, 60 Hz, friction 0.3. Bullet's have 128 nodes each and collide by clusters; "
        "with one cluster a ball is one convex hull, the quickest that Bullet has, and dents nowhere; with more they give "
        "way. isocoat at a tolerance of 5e-2. Milliseconds a step; the ratio is of Bullet to isocoat.\n\n"
    )
    cells = []
    bars = []
    for row in rows:
        for phase in ("landing", "lying"):
            peer, polar, default = (row[f"{who}_{phase}"] for who in ("bullet", "polar", "default"))
            cells.append([f"{row['balls']:.0f}", f"{row['clusters']:.0f}", phase, digits(peer), digits(polar),
                          f"{peer / polar:.2g}", digits(default), f"{peer / default:.2g}", f"{row['bullet_volume']:.0%}"])
            if phase == "lying" and row["clusters"] < 16:
                wanted = 2.5 if row["balls"] == 8 else 3.0
                clusters = "one cluster" if row["clusters"] == 1 else f"{row['clusters']:.0f} clusters"
                for who, mine in (("polar", polar), ("default", default)):
                    bars.append([f"{row['balls']:.0f} balls lying, Bullet with {clusters} a ball; {who}",
                                 f"{digits(peer)} ms", f"{digits(mine)} ms", f"{peer / mine:.2g}", f"at least {wanted:g}",
                                 verdict(peer / mine >= wanted)])
    text += table(["balls", "clusters a ball", "while", "Bullet", "polar", "ratio", "default", "ratio", "Bullet keeps volume"],
                  cells)
    deepest = max(row["isocoat_deepest"] for row in rows)
    text += f"\nisocoat's balls are pressed in by {100 * deepest:.1f}% of their radius at most.\n"
    return text, bars


def drake(programs, python):
    """The section on Drake, and its rows of bars."""
    title = "\n## Compliant spheres: Drake's hydroelastic contact\n\n"
    program = programs / "coat_spheres"
    try:
        found = subprocess.run([python, "-c", "import importlib.metadata as m, pydrake; print(m.version('drake'))"],
                               capture_output=True, text=True)
        version = found.stdout.strip() if found.returncode == 0 else None
    except OSError:
        version = None
    if version is None:
        return title + ("Not measured: the Python package drake is missing; `make peers` fetches it with pip into a virtual "
                        "environment under target/, which needs python3 with venv, the network, and a version of Python "
                        "that it is published for.\n"), []
    print(f"Drake {version}:", flush=True)
    output = run([python, ROOT / "tools/peers/drake_spheres.py", program])
    queries, scenes = output.removeprefix("query\n").split("scene\n")
    queries, scenes = rows_of(queries), rows_of(scenes)
    text = title + (
        f"Drake {version}. Two equal spheres of 0.1 m whose pressure falls linearly from the middle, turned anyhow: the "
        "same contact in both. The exact force is a closed form, `pi E (R - h)^2 (R + 2h) / 3R` at half the distance h. "
        "Error of the force, mean over the poses, and median time of a query.\n\n"
    )
    overlaps = sorted({row["overlap"] for row in queries})
    kinds = []
    for row in queries:
        kind = (row["who"], row["setting"])
        if kind not in kinds:
            kinds.append(kind)
    place = {(row["overlap"], row["who"], row["setting"]): row for row in queries}
    cells = []
    for who, setting in kinds:
        name = f"Drake, hint {setting}" if who == "drake" else f"{who}, tolerance {setting:.0e}"
        cells.append([name] + [f"{percent(place[o, who, setting]['force_error'])}, "
                               f"{digits(place[o, who, setting]['us_per_query'])} µs" for o in overlaps])
    text += table(["", *(f"overlap {o:.0%} of the radius" for o in overlaps)], cells)

    at = [row for row in queries if row["overlap"] == min(overlaps)]
    theirs = [row for row in at if row["who"] == "drake"]
    finest = min(theirs, key=lambda row: row["force_error"])
    ours = sorted((row for row in at if row["who"] == "polar"), key=lambda row: row["us_per_query"])
    as_good = next(row for row in ours if row["force_error"] <= finest["force_error"])
    fine = next(row for row in ours if row["force_error"] <= 1e-4)
    ratio = finest["us_per_query"] / as_good["us_per_query"]
    bars = [
        [f"two spheres, 5% overlap, at Drake's finest error of {percent(finest['force_error'])}; polar",
         f"{digits(finest['us_per_query'] / 1000)} ms", f"{digits(as_good['us_per_query'])} µs", f"{ratio:.0f}",
         "at least 500", verdict(ratio >= 500)],
        ["the same at an error of 1e-4; polar", "not reached", f"{digits(fine['us_per_query'])} µs", "", "below 25 µs",
         verdict(fine["us_per_query"] < 25)],
    ]

    text += (
        "\nTen such spheres of 1 kg and 1e5 Pa dropped into a hard box, friction 0.5, Drake's SAP solver. Seconds of "
        "processor time for a simulated second; the first one, while they fall and settle.\n\n"
    )
    steps = []
    for row in scenes:
        if row["dt"] not in steps:
            steps.append(row["dt"])
    kinds = []
    for row in scenes:
        kind = (row["who"], row["setting"])
        if kind not in kinds:
            kinds.append(kind)
    found = {(row["dt"], row["who"], row["setting"]): row for row in scenes}
    cells = []
    for who, setting in kinds:
        name = f"Drake, hint {setting}" if who == "drake" else f"{who}, tolerance {setting:.0e}"
        rows = [found[dt, who, setting] for dt in steps]
        cells.append([name] + [digits(row["seconds_per_second"]) for row in rows] + [digits(row["mean_height"]) for row in rows])
    text += table(["", *(f"dt = {dt} s" for dt in steps), *(f"mean height then, {dt} s [m]" for dt in steps)], cells)
    return text, bars


def splashsurf(programs):
    """The section on splashsurf, and its rows of bars."""
    title = "\n## The surface of particles: splashsurf\n\n"
    program = programs / "mesh-particles"
    if not program.exists():
        return title + "Not measured: `cargo build` of tools/peers/splashsurf did not succeed.\n", []
    print("splashsurf:", flush=True)
    text = title + (
        "Particles a spacing apart in a ball, fields that reach twice as far, cells of a quarter. splashsurf_lib 0.14 in "
        "single precision with SIMD, its density and decomposition included; isocoat in double, with normals. Shortest "
        "of nine calls each, in turns.\n\n"
    )
    cells, bars = [], []
    for row in rows_of(run([program])):
        peer, mine = row["splashsurf_ms"], row["isocoat_ms"]
        cells.append([f"{row['particles']:.0f}", digits(peer), f"{row['splashsurf_triangles']:.0f}", digits(mine),
                      f"{row['isocoat_triangles']:.0f}", f"{peer / mine:.2g}"])
        bars.append([f"mesh of {row['particles']:.0f} particles", f"{digits(peer)} ms", f"{digits(mine)} ms",
                     f"{peer / mine:.2g}", "at least 2", verdict(peer / mine >= 2)])
    return text + table(["particles", "splashsurf [ms]", "triangles", "isocoat [ms]", "triangles", "ratio"], cells), bars


def main():
    programs, python = pathlib.Path(sys.argv[1]), sys.argv[2]
    bullet_text, bullet_bars = bullet(programs)
    drake_text, drake_bars = drake(programs, python)
    mesh_text, mesh_bars = splashsurf(programs)
    bars = drake_bars + bullet_bars + mesh_bars
    page = HEAD + f"\nMeasured with {os.cpu_count()} processors, of which one was used.\n"
    if bars:
        page += "\n" + table(["", "peer", "isocoat", "ratio", "bar", ""], bars)
    page += drake_text + bullet_text + mesh_text
    for text in (drake_text, bullet_text, mesh_text):
        if "Not measured" in text:
            print(text.strip())
    (ROOT / "docs/peers.md").write_text(page, encoding="utf-8")
    print("docs/peers.md is written")


if __name__ == "__main__":
    main()
