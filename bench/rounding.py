#!/usr/bin/env python3
"""What rounding costs: presets against the same pipeline in double, whole pictures and stage by stage.

    SQUINT_DATA=... bench/rounding.py [--squint build/release/cli/squint] [--size 800] [--stage-size 160] [--kept FOLDER]
    bench/rounding.py --hard --views 64                    # hard cases from 64 sides, words against double: half an hour
    bench/rounding.py --hard                               # their slabs against the exact integral (docs/classification.md)

Prints the tables of docs/measurements/rounding.md.  The double path is slow: allow half an hour.  What was measured is kept in
FOLDER (default out/rounding), so that an interrupted run goes on; empty it to measure anew.
"""
import argparse
import json
import pathlib
import subprocess

SCENES = {
    "cthead": ["configs/bench/cthead_translucent.toml"],
    "engine": ["configs/bench/engine_translucent.toml"],
    "bonsai": ["configs/bench/bonsai_translucent.toml"],
    "built-in": ["--set", "classification.method=pc"],
}
LIGHT = {"unlit": ["--set", "shading.model=none"], "lit": []}
PRESETS = ["default", "squeeze"]
AIM = {"unlit": 60, "lit": 54}


def run(command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def foreground(comparison):
    return comparison["foreground"]["RGB"]


def kept(folder, name, make):
    path = folder / (name + ".json")
    if not path.exists():
        found = make()
        path.write_text(json.dumps(found))
    return json.loads(path.read_text())


def scene_arguments(scene, light):
    one_frame = ["--set", "camera.turntable=1"] if SCENES[scene] else []
    return SCENES[scene] + one_frame + LIGHT[light]


def picture(arguments, scene, light, preset):
    """The picture's path: rendered where it is not kept."""
    path = arguments.kept / f"{scene}.{light}.{preset}.{arguments.size}.exr"
    if not path.exists():
        run([arguments.squint, "render", *scene_arguments(scene, light), "--size", f"{arguments.size}x{arguments.size}",
             "--set", f"precision.preset={preset}", "-q", "-o", str(path)])
    return str(path)


def whole(arguments, scene, light, preset):
    command = [arguments.squint, "compare", picture(arguments, scene, light, preset), picture(arguments, scene, light, "real"),
               "--json"]
    found = json.loads(run(command))["channels"]["foreground"]["RGB"]
    return {"psnr": found["psnr"], "max": found["max_error_lsb8"], "bias": found["bias_lsb8"]}


def stages(arguments, scene, light, preset):
    size = f"{arguments.stage_size}x{arguments.stage_size}"
    record = json.loads(run([arguments.squint, "render", *scene_arguments(scene, light), "--size", size, "--set",
                             f"precision.preset={preset}", "--error", "-q", "--json", "-", "-o",
                             str(arguments.kept / "stage.exr")]))
    error = record["pictures"][0]["error"]
    found = {stage["stage"]: foreground(stage["against_real"])["psnr"] for stage in error["stages"]}
    found["all"] = foreground(error["against_real"])["psnr"]
    return found


def hard_cases(arguments):
    """Every hard case by every method, as `squint hard` measures it: slabs against the exact integral, or pictures from
    many sides, words against the same in double; LSB8."""
    views = ["--views", str(arguments.views), "--sizes", arguments.sizes] if arguments.views else []
    if arguments.record:
        record = json.loads(arguments.record.read_text())
    else:
        done = subprocess.run([arguments.squint, "hard", *views, "--json"], capture_output=True, text=True)
        if done.returncode > 1:
            raise SystemExit(done.stderr)
        record = json.loads(done.stdout)
    for number, (scene, methods) in enumerate(record["scenes"].items()):
        if number == 0:
            print("| scene | " + " | ".join(methods) + " |\n|---|" + "---|" * len(methods))
        cells = []
        for found in methods.values():
            if "refused" in found:
                cells.append("refused")
            elif "rounding_lsb8" in found:
                cells.append(f"{found['rounding_lsb8']:.2f}")
            else:
                beyond = "!" if found["outside_0_C_alpha_1"] else ""
                cells.append(f"{max(found['color_lsb8'], found['alpha_lsb8']):.2f}{beyond}")
        print(f"| {scene} | " + " | ".join(cells) + " |")


def decibels(value):
    return "exact" if value is None else f"{value:.1f}"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--squint", default="build/release/cli/squint")
    parser.add_argument("--size", type=int, default=800)
    parser.add_argument("--stage-size", type=int, default=160)
    parser.add_argument("--kept", type=pathlib.Path, default=pathlib.Path("out/rounding"))
    parser.add_argument("--hard", action="store_true")
    parser.add_argument("--views", type=int, default=0)
    parser.add_argument("--sizes", default="24,64")
    parser.add_argument("--record", type=pathlib.Path, help="what squint hard --json printed, instead of running it")
    arguments = parser.parse_args()
    arguments.kept.mkdir(parents=True, exist_ok=True)
    if arguments.hard:
        return hard_cases(arguments)

    print(f"## Whole pictures, {arguments.size}x{arguments.size}\n")
    print("| scene | light | aim | " + " | ".join(f"`{p}` dB | max LSB8 | bias LSB8" for p in PRESETS) + " |")
    print("|---|---|---|" + "---|---|---|" * len(PRESETS))
    for scene in SCENES:
        for light in LIGHT:
            row = f"| {scene} | {light} | {AIM[light]} |"
            for preset in PRESETS:
                found = kept(arguments.kept, f"{scene}.{light}.{preset}.{arguments.size}",
                             lambda: whole(arguments, scene, light, preset))
                row += f" {decibels(found['psnr'])} | {found['max']:.2f} | {found['bias']:+.3f} |"
            print(row, flush=True)

    for preset in PRESETS:
        print(f"\n## Each stage alone, `{preset}`, {arguments.stage_size}x{arguments.stage_size}, dB\n")
        header = None
        for scene in SCENES:
            for light in LIGHT:
                found = kept(arguments.kept, f"{scene}.{light}.{preset}.stages.{arguments.stage_size}",
                             lambda: stages(arguments, scene, light, preset))
                if header is None:
                    header = ["all", "sample location", "interpolation", "gradient", "classification", "shading", "compositing"]
                    print("| scene | light | " + " | ".join(header) + " |")
                    print("|---|---|" + "---|" * len(header))
                print(f"| {scene} | {light} | " + " | ".join(decibels(found[n]) if n in found else "-" for n in header) + " |",
                      flush=True)


if __name__ == "__main__":
    main()
