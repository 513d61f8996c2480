#!/usr/bin/env python3
"""Tables from the benchmarks' JSON, on standard output, as Markdown.

    bench/tables.py vtk vtk.jsonl [more.jsonl ...] > docs/measurements/vtk.md
    bench/tables.py equal-error equal_error.jsonl
    bench/tables.py frame frame.json          (Google Benchmark's)
"""
import json
import statistics
import sys


def read(paths):
    """Google Benchmark's one object, or our lines of {"machine": ...}, {"fog": ...} and {"case": ...}: of several
    files the cases of all, and the rest of the first."""
    result = {"cases": []}
    for path in paths:
        with open(path, encoding="utf-8") as file:
            text = file.read()
        if '"benchmarks"' in text:
            return json.loads(text)
        for line in text.splitlines():
            for key, value in json.loads(line).items():
                if key == "case":
                    result["cases"].append(value)
                else:
                    result.setdefault(key, value)
    return result


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def decibels(value):
    return "equal" if value >= 200 else f"{value:.1f}"


def milliseconds(value):
    if value is None:
        return "never"
    return f"{value:.1f}" if value < 100 else f"{value:.0f}"


def machine_line(result):
    m = result["machine"]
    return f"{m['cpu']}, {m['threads']} threads, g++ {m['compiler']}, squint {m['version']}; load {m['load']:.1f} at the start."


def label(case):
    return f"{case['scene'].replace('_', ' ')}, {'lit' if case['lit'] else 'unlit'}, step {case['step']:g}"


def vtk_summary(runs):
    """Factors of speed over some runs, and who is nearer to the truth."""
    rows = []
    for method in ("pc", "pips"):
        for lit in (False, True):
            chosen = [r for c, r in runs if c["lit"] == lit]
            if not chosen:
                continue
            kinds = [("ray cast", [r[method]["times_faster"] for r in chosen]),
                     ("whole frame", [r[method]["times_faster_whole"] for r in chosen]),
                     ("processor", [r[method]["times_faster_processor"] for r in chosen]),
                     ("first frame", [r["vtk"]["first_ms"] / r[method]["first_ms"] for r in chosen])]
            rows += [[method, "lit" if lit else "unlit", name, f"{statistics.median(factors):.1f}", f"{min(factors):.1f}",
                      f"{max(factors):.1f}"] for name, factors in kinds]
    print(table(["method", "light", "times faster than VTK", "median", "worst", "best"], rows))
    worse = [label(c) for c, r in runs if r["pc"]["psnr_real"] < r["vtk"]["psnr_double"]]
    print(f"Rounding: PC is nearer to its double picture than VTK in {len(runs) - len(worse)} of {len(runs)} runs"
          + (f"; not in {', '.join(worse)}" if worse else "") + ".")
    gains = [r["pips"]["psnr_reference"] - r["vtk"]["psnr_reference"] for _, r in runs]
    print(f"Reference: PIPS(1) is nearer than VTK by {statistics.median(gains):.1f} dB in the median, "
          f"{min(gains):.1f} dB at least.\n")


def vtk(result):
    """Every case and thread count: times, factors and errors, then the summary and the fog."""
    runs = [(case, run) for case in result["cases"] for run in case["runs"]]
    kinds = sorted({(c["step"], r["threads"]) for c, r in runs}, key=lambda kind: (-kind[0], kind[1]))
    print("# Against VTK's fixed-point mapper\n")
    print("<!-- Written by `bench/tables.py vtk`; do not edit. -->\n")
    print(machine_line(result), "\n")
    print(
        "VTK 9.1's vtkFixedPointVolumeRayCastMapper, its ray cast timed alone, without a window; space leaping and early\n"
        "termination on, automatic adjustment off, ImageSampleDistance 1.  The same voxels in memory, transfer function, camera,\n"
        "light and step; frames of a turntable, VTK's and ours in turn; times are medians in ms, factors medians of the frames'\n"
        "quotients.  `processor`: the same factor in processor time of the whole frame, which a busy machine does not stretch.\n"
        "`load`: runnable processes while it ran.  Whatever else the machine did, both programs met in turn: the factors count.\n\n"
        "Errors are foreground PSNR in dB.  `VTK, own`: against VTK's own samples in doubles (its phase, its count, its end at\n"
        "T < 1/128, its shades of encoded normals); `ours, own`: against the same picture without rounding (preset `real`). `ref`:\n"
        "against the converged reference.  VTK counts its samples from the near plane, squint from the entry: the two double\n"
        "pictures differ by that phase.\n")
    print(f"{len(runs)} of the 80 cases (ten scenes, lit and unlit, steps 1 and 1/2, 1 and 2 threads): "
          + "; ".join(f"step {step:g} on {threads} thread{'s' if threads > 1 else ''}, "
                      f"{sum((c['step'], r['threads']) == (step, threads) for c, r in runs)}" for step, threads in kinds)
          + ".\n")
    for step in sorted({c["step"] for c, _ in runs}, reverse=True):
        print(f"## Summary, step {step:g}\n")
        vtk_summary([(c, r) for c, r in runs if c["step"] == step])
    print("## Times\n")
    print(table(
        ["scene", "threads", "VTK", "PC", "PIPS(1)", "PC faster", "processor", "PIPS(1) faster", "first VTK", "first PC", "load"],
        [[label(c), str(r["threads"]), milliseconds(r["vtk"]["cast_ms"]), milliseconds(r["pc"]["cast_ms"]),
          milliseconds(r["pips"]["cast_ms"]), f"{r['pc']['times_faster']:.1f}",
          f"{r['pc']['times_faster_processor']:.1f}", f"{r['pips']['times_faster']:.1f}",
          milliseconds(r["vtk"]["first_ms"]), milliseconds(r["pc"]["first_ms"]), f"{r['load']:.1f}"] for c, r in runs]))
    print("## Errors\n")
    print(table(
        ["scene", "threads", "VTK, own", "PC, own", "PIPS(1), own", "VTK, ref", "PC, ref", "PIPS(1), ref"],
        [[label(c), str(r["threads"]), decibels(r["vtk"]["psnr_double"]), decibels(r["pc"]["psnr_real"]),
          decibels(r["pips"]["psnr_real"]), decibels(r["vtk"]["psnr_reference"]), decibels(r["pc"]["psnr_reference"]),
          decibels(r["pips"]["psnr_reference"])] for c, r in runs]))
    print("## Error against step\n")
    print("A cube of fog, 128^3, alpha 0.03 a voxel: each picture against the same samples in doubles.\n")
    print(table(["step", "VTK, own", "PC, own", "VTK, ref", "PC, ref"],
                [[f"1/{1 / p['step']:g}" if p["step"] < 1 else "1", decibels(p["vtk_psnr_double"]),
                  decibels(p["pc_psnr_real"]), decibels(p["vtk_psnr_reference"]), decibels(p["pc_psnr_reference"])]
                 for p in result["fog"]]))


def equal_error(result):
    print(machine_line(result), "\n")
    names = []
    for scene in result["cases"]:
        names += [c["name"] for c in scene["contenders"] if c["name"] not in names]
    for limit in (40, 50):
        rows = []
        for scene in result["cases"]:
            at = {c["name"]: c[f"ms_{limit}"] for c in scene["contenders"]}
            rows.append([f"{scene['scene'].replace('_', ' ')}, {'lit' if scene['lit'] else 'unlit'}"]
                        + [milliseconds(at[n]) if n in at else "-" for n in names] + [f"{scene['load']:.1f}"])
        print(f"ms to reach {limit} dB against the reference (one frame, ray cast alone):\n")
        print(table(["scene"] + names + ["load"], rows))


def medians(result):
    """Name -> figures: the medians of repetitions where there are any."""
    runs = {}
    for run in result["benchmarks"]:
        if run.get("run_type") == "iteration" and not run.get("error_occurred"):
            runs.setdefault(run["name"].replace("/process_time/manual_time", ""), []).append(run)
    keys = ("real_time", "cpu_time", "at", "ns_per_sample", "ns_per_visited", "psnr", "peak_mib", "setup_ms",
            "whole_ms", "load")
    return {name: {k: statistics.median(r[k] for r in list_) for k in keys if k in list_[0]}
            | {"label": list_[0].get("label", "")} for name, list_ in runs.items()}


def frame(result):
    rows = []
    for name, r in medians(result).items():
        rows.append(name.split("/")[1:] + [milliseconds(r["real_time"]), milliseconds(r["cpu_time"]),
                                           f"{r['ns_per_sample']:.2f}", decibels(r["psnr"]), f"{r['load']:.1f}"])
    print(table(["scene", "light", "step", "method", "way", "threads", "ms", "processor ms", "ns per sample", "dB", "load"],
                rows))


if __name__ == "__main__":
    kinds = {"vtk": vtk, "equal-error": equal_error, "frame": frame}
    if len(sys.argv) < 3 or sys.argv[1] not in kinds:
        sys.exit(__doc__)
    kinds[sys.argv[1]](read(sys.argv[2:]))
