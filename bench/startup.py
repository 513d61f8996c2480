#!/usr/bin/env python3
"""What a call costs before its work begins: bench/startup.py PROGRAM [--check]

Prints a row a call: processor time and peak memory, medians of several runs.  With --check: exit code 1 where a call
goes beyond its bounds."""
import os
import statistics
import struct
import subprocess
import sys
import tempfile

RUNS = 7
SMALL = "--set volume.procedural=sphere --set volume.dims=64"  # 0.5 MB of voxels
PICTURE = SMALL + " --size 64x48 -q -o "

# A call, its bounds in ms of processor time and MB.  None: shown, not bounded.
CALLS = [
    ("--version", 30, 30),
    ("--help", 30, 30),
    ("number u1.15 0.7", 30, 30),
    ("info SMALL.nrrd", 30, 30),
    ("info SMALL.nii", 30, 30),  # its reader is a child: both count
    ("plan " + SMALL, 30, 30),
    ("plan", None, 30),
    ("render " + PICTURE + "OUT.exr", None, None),
]


def run(program, arguments, folder):
    """-> processor time in ms, peak memory in MB."""
    child = subprocess.Popen([program, *arguments.split()], cwd=folder, stdout=subprocess.DEVNULL,
                             stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    if status != 0:
        sys.exit(f"squint {arguments}: exit status {status}")
    return 1000 * (usage.ru_utime + usage.ru_stime), usage.ru_maxrss / 1024


def write_nifti(path, side):
    """A cube of 16-bit voxels: NIfTI-1's header of 348 bytes, 4 of padding, voxels."""
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, side, side, side, 1, 1, 1, 1)  # dim
    struct.pack_into("<2h", header, 70, 4, 16)  # datatype int16, bitpix
    struct.pack_into("<8f", header, 76, 1, 1, 1, 1, 1, 1, 1, 1)  # pixdim
    struct.pack_into("<3f", header, 108, 352, 1, 0)  # vox_offset, scl_slope, scl_inter
    header[344:348] = b"n+1\0"
    with open(path, "wb") as file:
        file.write(header + struct.pack("<h", 7) * side**3)


def main():
    program, check = os.path.abspath(sys.argv[1]), "--check" in sys.argv
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        run(program, "volume sphere --dims 64 -o SMALL.nrrd", folder)
        write_nifti(os.path.join(folder, "SMALL.nii"), 64)
        print("| call | ms of processor time | MB |\n|---|---|---|")
        for arguments, most_ms, most_mb in CALLS:
            runs = [run(program, arguments, folder) for _ in range(RUNS)]
            ms, mb = (statistics.median(values) for values in zip(*runs))
            beyond = (most_ms and ms > most_ms) or (most_mb and mb > most_mb)
            failed += bool(beyond)
            print(f"| `{arguments}` | {ms:.1f} | {mb:.1f} |" + (" beyond its bounds" if beyond else ""))
    return 1 if check and failed else 0


sys.exit(main())
