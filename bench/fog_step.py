#!/usr/bin/env python3
"""Fog at ever smaller steps: PSNR of a preset against the same pipeline in double, as a Markdown table.

    bench/fog_step.py [build/release/cli/squint]          # docs/measurements/rounding.md#fog-at-ever-smaller-steps; minutes: the double path is slow
"""
import json
import subprocess
import sys

STEPS = [1, 1 / 2, 1 / 4, 1 / 8, 1 / 16, 1 / 32]
FOGS = [0.02, 0.003]  # opacity of one voxel


def psnr(squint, alpha, step):
    record = json.loads(subprocess.run(
        [squint, "render", "--size", "16x16", "--set", "volume.procedural=constant", "--set", "shading.model=none",
         "--set", f"sampling.step={step}", "--set", "transfer_function.unit_distance=1",
         "--set", f"transfer_function.points=[[0,1,1,1,{alpha}],[255,1,1,1,{alpha}]]", "--set", "precision.preset=default",
         "--error", "-q", "--json", "-", "-o", "fog_step.exr"],
        check=True, capture_output=True, text=True).stdout)
    figure = record["pictures"][0]["error"]["against_real"]["foreground"]["RGB"]["psnr"]
    return figure, record["wires"]["transparency"]["format"]


def main():
    squint = sys.argv[1] if len(sys.argv) > 1 else "build/release/cli/squint"
    print("| step | C, T, alpha | " + " | ".join(f"opacity {a} a voxel, dB" for a in FOGS) + " |")
    print("|---|---|" + "---|" * len(FOGS))
    for step in STEPS:
        found = [psnr(squint, alpha, step) for alpha in FOGS]
        print(f"| {'1' if step == 1 else f'1/{round(1 / step)}'} | {found[0][1]} | "
              + " | ".join(f"{figure:.1f}" for figure, _ in found) + " |", flush=True)


if __name__ == "__main__":
    main()
