#!/usr/bin/env python3
"""Light inside a slab: error and time of every rule, beside PC's and beside the unlit scene's.

    SQUINT_DATA=... bench/inside.py error [--size 256x256] [--scenes engine_translucent ...] [--squint build/release/cli/squint]
    SQUINT_DATA=... bench/inside.py speed

Prints Markdown.  Error: foreground PSNR against the exact integral along each ray, dB, `precision.preset` real and default.
Speed: processor time of a program that draws one lit frame, over that of one with `mean`: the median of paired runs.
"""
import argparse
import json
import pathlib
import resource
import statistics
import subprocess

SCENES = sorted(p.stem for p in pathlib.Path("configs/bench").glob("*.toml"))
RULES = ["mean", "front", "middle", "adaptive"]


def settings(rule, step, preset="default"):
    method = "pc" if rule == "pc" else "pips"
    chosen = [] if rule in ("pc", "unlit") else [f"shading.inside={rule}"]
    if rule == "unlit":
        chosen = ["lights=[]"]
    return [f"classification.method={method}", f"sampling.step={step}", f"precision.preset={preset}", *chosen]


def run(squint, scene, size, settings, *more):
    command = [squint, "render", f"configs/bench/{scene}.toml", "--size", size, "-q", "--json", "-", "-o", "/dev/null", *more]
    for setting in settings:
        command += ["--set", setting]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    record = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return json.loads(record)["pictures"][0], after.ru_utime - before.ru_utime


def psnr(picture):
    figure = picture["error"]["against_reference"]["foreground"]["RGB"]["psnr"]
    return "exact" if figure is None else f"{figure:.1f}"


def error(squint, scenes, size):
    print("| scene | step | preset | unlit PIPS(1) | PC | " + " | ".join(RULES) + " |")
    print("|---" * (5 + len(RULES)) + "|")
    for scene in scenes:
        for step in (1, 0.5):
            for preset in ("real", "default"):
                cells = [psnr(run(squint, scene, size, settings(rule, step, preset), "--reference")[0])
                         for rule in ["unlit", "pc", *RULES]]
                print(f"| {scene} | {step} | {preset} | " + " | ".join(cells) + " |", flush=True)


def speed(squint, scenes, size, pairs):
    print("| scene | step | " + " | ".join(["pc", *RULES[1:]]) + " |")
    print("|---" * (2 + len(RULES)) + "|")
    for scene in scenes:
        for step in (1, 0.5):
            cells = []
            for rule in ["pc", *RULES[1:]]:
                ratios = []
                for _ in range(pairs):
                    seconds = [run(squint, scene, size, settings(r, step), "--threads", "1")[1] for r in (rule, "mean")]
                    ratios.append(seconds[0] / seconds[1])
                cells.append(f"{statistics.median(ratios):.2f}")
            print(f"| {scene} | {step} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["error", "speed"])
    parser.add_argument("--size", default="256x256")
    parser.add_argument("--scenes", nargs="+", default=SCENES)
    parser.add_argument("--pairs", type=int, default=7)
    parser.add_argument("--squint", default="build/release/cli/squint")
    a = parser.parse_args()
    if a.what == "error":
        error(a.squint, a.scenes, a.size)
    else:
        speed(a.squint, a.scenes, a.size, a.pairs)
