#!/usr/bin/env python3
"""Time per frame against error, one SVG a scene, from bench_equal_error's lines.

    build/release/bench/bench_equal_error scenes=figure_5,cthead_translucent,figure_7,figure_8,head size=128 every=2 \
        all=1 finest=0.25 > out/plots.jsonl
    bench/plots.py out/plots.jsonl docs/images    # the second half of docs/measurements/time-error.md      # and docs/images/time_error_SCENE.svg

A line a method, a mark a step: 4 voxels is the leftmost mark as a rule, 1/4 the rightmost.  Up and to the left is better.
"""
import json
import math
import pathlib
import sys

WIDTH, HEIGHT = 640, 420
LEFT, RIGHT, TOP, BOTTOM = 58, 118, 34, 46
COLORS = {"vtk": "#000000", "pc": "#888888", "pc_mid": "#bbaa66", "pi2d": "#d62728", "pi1d": "#8c564b", "pi1d_engel": "#e377c2",
          "pips_1": "#1f77b4", "pips_3": "#17becf", "leg_2": "#2ca02c", "leg_3": "#98c33c"}
NAMES = {"vtk": "VTK", "pc": "PC", "pc_mid": "PC, middle", "pi2d": "PI2D", "pi1d": "PI1D", "pi1d_engel": "PI1D, Engel",
         "pips_1": "PIPS(1)", "pips_3": "PIPS(3)", "leg_2": "LEG(2)", "leg_3": "LEG(3)"}
TITLES = {"figure_5": "sphere 64^3, six spikes", "figure_7": "chest phantom, one wall", "figure_8": "polynomial 64^3, five walls",
          "head": "built-in head", "cthead_translucent": "cthead, translucent", "cthead_opaque": "cthead, opaque"}


def title_of(case):
    name = TITLES.get(case["scene"], case["scene"].replace("_", " "))
    return f"{name}, {'lit' if case['lit'] else 'unlit'}"


def step_name(step):
    return f"{step:g}" if step >= 1 else f"1/{1 / step:g}"


def ticks(low, high):
    """1, 2 and 5 times powers of ten."""
    found = []
    for power in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1):
        found += [m * 10.0 ** power for m in (1, 2, 5) if low <= m * 10.0 ** power <= high]
    return found


def text(x, y, words, anchor="middle", size=12, more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" {more}>{words}</text>'


def svg(case):
    lines = [(c["name"], [(p["ms"], min(p["psnr"], 120), p["step"]) for p in c["points"]]) for c in case["contenders"]]
    times = [t for _, points in lines for t, _, _ in points]
    errors = [e for _, points in lines for _, e, _ in points]
    x0, x1 = min(times) / 1.15, max(times) * 1.15
    y0, y1 = 5 * math.floor(min(errors) / 5), 5 * math.ceil(max(errors) / 5)
    x = lambda t: LEFT + (WIDTH - LEFT - RIGHT) * math.log(t / x0) / math.log(x1 / x0)
    y = lambda e: HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (e - y0) / (y1 - y0)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
           'font-family="sans-serif">', f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
           text(LEFT, 20, title_of(case), "start", 14)]
    for t in ticks(x0, x1):
        out.append(f'<path d="M{x(t):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#ddd"/>')
        out.append(text(x(t), HEIGHT - BOTTOM + 16, f"{t:g}"))
    for e in range(y0, y1 + 1, 10 if y1 - y0 > 40 else 5):
        out.append(f'<path d="M{LEFT} {y(e):.1f}H{WIDTH - RIGHT}" stroke="{"#999" if e in (40, 50) else "#ddd"}"/>')
        out.append(text(LEFT - 6, y(e) + 4, e, "end"))
    out.append(text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10, "ms a frame"))
    middle = (TOP + HEIGHT - BOTTOM) / 2
    out.append(text(16, middle, "dB against the reference", more=f'transform="rotate(-90 16 {middle:.1f})"'))
    for row, (name, points) in enumerate(lines):
        color = COLORS.get(name, "#444")
        path = " ".join(f"{x(t):.1f},{y(e):.1f}" for t, e, _ in points)
        out.append(f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="1.6"/>')
        for t, e, step in points:
            out.append(f'<circle cx="{x(t):.1f}" cy="{y(e):.1f}" r="{4 if step == 1 else 2.5}" fill="{color}">'
                       f"<title>{NAMES.get(name, name)}, step {step_name(step)}: {t:.1f} ms, {e:.1f} dB</title></circle>")
        at = TOP + 14 + 17 * row
        out.append(f'<path d="M{WIDTH - RIGHT + 10} {at - 4}h16" stroke="{color}" stroke-width="2.5"/>')
        out.append(text(WIDTH - RIGHT + 31, at, NAMES.get(name, name), "start"))
    return "\n".join(out + ["</svg>"]) + "\n"


HEAD = """# Time per frame against error

<!-- Written by `bench/plots.py`; do not edit. -->

{machine}

`bench_equal_error ... all=1 finest=0.25`: every method, and VTK's fixed-point mapper, at steps of 4, 2, 1, 1/2 and 1/4 voxels, in the preset
`default`, one thread, ray cast alone. Error is the foreground PSNR against the converged reference. The large mark is the step of one voxel.
Up and to the left is better."""


def main():
    lines = pathlib.Path(sys.argv[1]).read_text().splitlines()
    folder = pathlib.Path(sys.argv[2])
    for line in lines:
        if "machine" in json.loads(line):
            m = json.loads(line)["machine"]
            print(HEAD.format(machine=f"{m['cpu']}, {m['threads']} threads, g++ {m['compiler']}, squint {m['version']}; "
                                      f"load {m['load']:.1f} at the start."))
        case = json.loads(line).get("case")
        if not case:
            continue
        name = f"time_error_{case['scene']}{'_lit' if case['lit'] else ''}.svg"
        (folder / name).write_text(svg(case))
        steps = sorted({p["step"] for c in case["contenders"] for p in c["points"]}, reverse=True)
        print(f"\n## {title_of(case)}\n\n![{title_of(case)}](../images/{name})\n")
        print("| ms / dB at a step of | " + " | ".join(map(step_name, steps)) + " |\n|---|" + "---|" * len(steps))
        for contender in case["contenders"]:
            at = {p["step"]: f"{p['ms']:.1f} / {p['psnr']:.1f}" for p in contender["points"]}
            print(f"| {NAMES.get(contender['name'], contender['name'])} | " + " | ".join(at.get(s, "-") for s in steps) + " |")


if __name__ == "__main__":
    main()
