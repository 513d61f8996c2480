#!/usr/bin/env python3
"""Lee & Shin 2013, tables 3 and 4, with squint: PIPS(1) against PI2D, and speed.

    SQUINT_DATA=... bench/lee_shin.py quality [--squint build/release/cli/squint]     # Table 3: PSNR over the whole picture
    SQUINT_DATA=... bench/lee_shin.py speed                                           # Table 4: frames a second

Prints Markdown.  The scenes are configs/lee_shin; PI2D has a node an entry, and 16 nodes an entry (at most 4096) as `exact`.
Speed is the median of five frames of a turntable behind a first one, ray cast alone, all cores.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile

FIGURES = {
    5: ("sphere 64^3, six spikes", 256, (41.90, 44.53, 45.42), (300.65, 233.44, 277.43, 290.28)),
    6: ("head", 4096, (52.80, 49.10, 49.23), (192.66, 186.84, 158.09, 185.53)),
    7: ("chest phantom", 4096, (46.69, 45.29, 45.29), (34.99, 21.23, 51.91, 61.54)),
    8: ("polynomial 64^3, five walls", 256, (65.71, 63.07, 66.21), None),
}
METHODS = ["pc", "pi1d", "pi2d", "pips"]
MOST_NODES = 4096
SPEED_SIZE = "512x512"


def render(squint, figure, method, path, *more):
    return json.loads(subprocess.run(
        [squint, "render", f"configs/lee_shin/figure_{figure}.toml", "--size", "256x256", "--set",
         f"classification.method={method}", *more, "-q", "--json", "-", "-o", str(path)],
        check=True, capture_output=True, text=True).stdout)["pictures"]


def psnr(squint, a, b):
    channels = json.loads(subprocess.run([squint, "compare", str(a), str(b), "--json"], check=True, capture_output=True,
                                         text=True).stdout)["channels"]["all"]
    return [channels[c]["psnr"] for c in "RGB"]


def text(values):
    return " ".join("exact" if v is None else f"{v:.1f}" for v in values)


def quality(squint, folder):
    print("| figure | PIPS(1) against PI2D: R G B | against exact PI2D | PI1D against exact PI2D | paper: PIPS(1) against PI2D |")
    print("|---|---|---|---|---|")
    for figure, (name, nodes, paper, _) in FIGURES.items():
        paths = {}
        for method, size in (("pips", nodes), ("pi1d", nodes), ("pi2d", nodes), ("pi2d", MOST_NODES)):
            path = paths[method, size] = folder / f"{figure}.{method}.{size}.exr"
            if not path.exists():
                render(squint, figure, method, path, "--set", f"classification.table_size={size}")
        exact = paths["pi2d", MOST_NODES]
        print(f"| {figure}, {name} | {text(psnr(squint, paths['pips', nodes], paths['pi2d', nodes]))} | "
              f"{text(psnr(squint, paths['pips', nodes], exact))} | {text(psnr(squint, paths['pi1d', nodes], exact))} | "
              f"{' '.join(f'{p:.2f}' for p in paper)} |", flush=True)


def speed(squint, folder):
    print(f"| figure, {SPEED_SIZE} pixels | PC | PI1D | PI2D | PIPS(1) | PIPS(1) without prediction | paper (GPU): PC PI1D PI2D PIPS(1) |")
    print("|---|---|---|---|---|---|---|")
    for figure, (name, nodes, _, paper) in FIGURES.items():
        row = []
        for method, prediction in [(m, "true") for m in METHODS] + [("pips", "false")]:
            frames = render(squint, figure, method, folder / "speed.exr", "--size", SPEED_SIZE, "--set", "camera.turntable=6",
                            "--set", f"classification.table_size={nodes}", "--set",
                            f"classification.opaque_prediction={prediction}")
            row.append(f"{1 / statistics.median(frame['seconds'] for frame in frames[1:]):.1f}")
        print(f"| {figure}, {name} | {' | '.join(row)} | "
              f"{' '.join(map(str, paper)) if paper else '-'} |", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=["quality", "speed"])
    parser.add_argument("--squint", default="build/release/cli/squint")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        {"quality": quality, "speed": speed}[arguments.what](arguments.squint, pathlib.Path(folder))


if __name__ == "__main__":
    main()
