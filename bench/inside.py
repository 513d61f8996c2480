#!/usr/bin/env python3
"""Light inside a slab: error and time of every rule, beside PC's and beside the unlit scene's.

    SQUINT_DATA=... squint sweep configs/sweeps/inside.toml -o RUN     (again to go on; --set image.width=64 ... for a quick one)
    bench/inside.py error RUN
    SQUINT_DATA=... bench/inside.py speed [--size 256x256] [--scenes engine_translucent ...] [--before PROGRAM]

Prints Markdown.  Error: foreground PSNR of the sweep's points against the exact integral along each ray, dB.
Speed: processor time of a program that draws one lit frame, over that of one with `mean` (of another program with --before):
the median of paired runs.
"""
import argparse
import json
import pathlib
import resource
import statistics
import subprocess

SCENES = sorted(p.stem for p in pathlib.Path("configs/bench").glob("*.toml"))
RULES = ["mean", "front", "middle", "centroid", "two_point", "adaptive", "linear", "nlpi"]


def settings(rule, step):
    method = "pc" if rule == "pc" else "pips"
    chosen = [] if rule == "pc" else [f"shading.inside={rule}"]
    return [f"classification.method={method}", f"sampling.step={step}", *chosen]


def run(squint, scene, size, settings, *more):
    command = [squint, "render", f"configs/bench/{scene}.toml", "--size", size, "-q", "-o", "/dev/null", *more]
    for setting in settings:
        command += ["--set", setting]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(command, check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def error(folder):
    sweep = json.loads((folder / "sweep.json").read_text())
    ways, rows = sweep["axes"]["light"], {}
    for path in sorted((folder / "points").glob("*.json")):
        point = json.loads(path.read_text())
        if point["status"] != "done":
            continue
        at = next(p["values"] for p in sweep["points"] if p["hash"] == point["hash"])
        row = (pathlib.Path(point["scene"]).stem, at["sampling.step"], at["precision.preset"])
        figure = point["error"]["reference"]["color"]["psnr"]
        rows.setdefault(row, {})[at["light"]] = "exact" if figure is None else f"{figure:.1f}"
    print("| scene | step | preset | " + " | ".join(ways) + " |")
    print("|---" * (3 + len(ways)) + "|")
    for row in sorted(rows, key=lambda r: (r[0], r[2], -r[1])):
        print(f"| {row[0]} | {row[1]:g} | {row[2]} | " + " | ".join(rows[row].get(way, "") for way in ways) + " |")


def speed(squint, before, scenes, size, pairs):
    ways = ["pc", *(RULES if before else RULES[1:])]
    print("| scene | step | " + " | ".join(ways) + " |")
    print("|---" * (2 + len(ways)) + "|")
    for scene in scenes:
        for step in (1, 0.5):
            cells = []
            for rule in ways:
                ratios = []
                for _ in range(pairs):
                    seconds = [run(program, scene, size, settings(r, step), "--threads", "1")
                               for program, r in ((squint, rule), (before or squint, "mean"))]
                    ratios.append(seconds[0] / seconds[1])
                cells.append(f"{statistics.median(ratios):.2f}")
            print(f"| {scene} | {step} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="what", required=True)
    verbs.add_parser("error").add_argument("folder", type=pathlib.Path)
    timed = verbs.add_parser("speed")
    timed.add_argument("--size", default="256x256")
    timed.add_argument("--scenes", nargs="+", default=SCENES)
    timed.add_argument("--pairs", type=int, default=7)
    timed.add_argument("--squint", default="build/release/cli/squint")
    timed.add_argument("--before", help="a program of before, whose `mean` is the measure")
    a = parser.parse_args()
    if a.what == "error":
        error(a.folder)
    else:
        speed(a.squint, a.before, a.scenes, a.size, a.pairs)
