#!/usr/bin/env python3
"""How time and memory grow: tables and slopes as Markdown on standard output, and a plot of them.

    SQUINT_BENCH_LARGE=1 build/release/bench/bench_growth --benchmark_out=out/growth.json
    bench/growth.py out/growth.json docs/images > docs/measurements/growth.md        # and docs/images/growth.svg
"""
import math
import pathlib
import statistics
import sys

sys.dont_write_bytecode = True  # no folder of compiled files beside the scripts
from plots import text, ticks
from tables import medians, milliseconds, read, table

AXES = {  # name of the benchmark's axis -> what is on the plot's
    "image": "pixels a side", "volume": "voxels a side", "step": "step, in voxels", "threads": "threads"}
LINES = {"volume": [("volume", "#1f77b4", ""), ("volume_no_skipping", "#d62728", "no skipping")]}
PANEL, GAP, HIGH, TOP = 190, 62, 150, 40


def slope(points):
    """Of log y over log x, by least squares."""
    x, y = [math.log(p[0]) for p in points], [math.log(p[1]) for p in points]
    mx, my = statistics.mean(x), statistics.mean(y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx) ** 2 for a in x)


def panel(left, top, lines, across, up):
    """One log-log plot of lines of (name, colour, points), `across` and `up` for its axes."""
    xs, ys = [p[0] for _, _, points in lines for p in points], [p[1] for _, _, points in lines for p in points]
    x0, x1, y0, y1 = min(xs) / 1.1, max(xs) * 1.1, min(ys) / 1.3, max(ys) * 1.3
    x = lambda v: left + PANEL * math.log(v / x0) / math.log(x1 / x0)
    y = lambda v: top + HIGH - HIGH * math.log(v / y0) / math.log(y1 / y0)
    out = [f'<rect x="{left}" y="{top}" width="{PANEL}" height="{HIGH}" fill="none" stroke="#999"/>']
    decades = [t for t in ticks(y0, y1) if y1 / y0 < 30 or f"{t:e}".startswith("1")]
    for v in decades:
        out += [f'<path d="M{left} {y(v):.1f}h{PANEL}" stroke="#ddd"/>', text(left - 4, y(v) + 4, f"{v:g}", "end", 10)]
    for v in sorted(set(xs)):
        out += [f'<path d="M{x(v):.1f} {top}v{HIGH}" stroke="#ddd"/>', text(x(v), top + HIGH + 13, f"{v:g}", size=10)]
    if across:
        out.append(text(left + PANEL / 2, top + HIGH + 30, across))
    if up:
        out.append(text(left - 42, top + HIGH / 2, up, more=f'transform="rotate(-90 {left - 42} {top + HIGH / 2})"'))
    for row, (name, color, points) in enumerate(lines):
        path = " ".join(f"{x(a):.1f},{y(b):.1f}" for a, b in points)
        out.append(f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="1.6"/>')
        out += [f'<circle cx="{x(a):.1f}" cy="{y(b):.1f}" r="2.5" fill="{color}"><title>{a:g}: {b:.4g}</title></circle>'
                for a, b in points]
        if len(points) > 1 and name is not None:
            falls = slope(points) < 0
            out.append(text(left + PANEL - 6 if falls else left + 6, top + 14 + 14 * row,
                            f"{name + ': ' if name else ''}slope {slope(points):.2f}", "end" if falls else "start", 11,
                            f'fill="{color}"'))
    return out


def svg(axes):
    width, height = GAP + len(AXES) * (PANEL + GAP), TOP + 2 * HIGH + 72
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
           'font-family="sans-serif" font-size="12">', f'<rect width="{width}" height="{height}" fill="white"/>']
    for column, (axis, across) in enumerate(AXES.items()):
        left = GAP + column * (PANEL + GAP)
        out.append(text(left + PANEL / 2, TOP - 14, f"against {axis}", size=14))
        parts = [(name, color, axes[key]) for key, color, name in LINES.get(axis, [(axis, "#1f77b4", "")]) if key in axes]
        for row, (key, up) in enumerate((("real_time", "ms a frame"), ("peak_mib", "peak MiB"))):
            lines = [(name if row == 0 else None, color, sorted((r["at"], r[key]) for r in runs)) for name, color, runs in parts]
            out += panel(left, TOP + row * (HIGH + 30), lines, across if row == 1 else "", up if column == 0 else "")
    return "\n".join(out + ["</svg>"]) + "\n"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    result = read([sys.argv[1]])
    axes = {}
    for name, run in medians(result).items():
        axes.setdefault(name.split("/")[1], []).append(run)
    machine = result["context"]
    print("# How time and memory grow\n\n<!-- Written by `bench/growth.py`; do not edit. -->\n")
    print(f"{machine['num_cpus']} threads at {machine['mhz_per_cpu']} MHz; load {machine['load_avg'][0]:.1f} at the start.\n"
          "The built-in phantom filling 800x800 pixels, 256^3 voxels, step 1, one thread, PC, unlit, but for what grows. Times are the\n"
          "ray cast alone, of frames behind the first; `set-up` is what the first one waits for; `peak` is resident memory, volume\n"
          "included. `visited`: samples that were not left out as empty.\n\n![How time and memory grow](../images/growth.svg)\n")
    for axis, runs in axes.items():
        print(f"## {axis.replace('_', ' ')}\n")
        print(table([axis.split("_")[0], "ms", "processor ms", "ns per sample", "ns per visited", "layout", "set-up ms", "peak MiB", "load"],
                    [[f"{r['at']:g}", milliseconds(r["real_time"]), milliseconds(r["cpu_time"]), f"{r['ns_per_sample']:.2f}",
                      f"{r['ns_per_visited']:.2f}", r["label"], milliseconds(r["setup_ms"]), f"{r['peak_mib']:.0f}", f"{r['load']:.1f}"]
                     for r in runs]))
        if len(runs) > 1:
            print(f"Time grows with {axis.split('_')[0]} to the power {slope([(r['at'], r['real_time']) for r in runs]):.2f}.\n")
    for axis in ("volume", "volume_no_skipping"):
        cost = {r["at"]: r["ns_per_visited"] for r in axes.get(axis, [])}
        if 256 in cost and 1024 in cost:
            print(f"A visited sample at 1024^3 costs {cost[1024] / cost[256]:.2f} times that at 256^3"
                  f"{' without skipping' if axis != 'volume' else ''}.")
    (pathlib.Path(sys.argv[2]) / "growth.svg").write_text(svg(axes))


if __name__ == "__main__":
    main()
