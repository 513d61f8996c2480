#!/usr/bin/env python3
"""What a call costs before its work begins: bench/startup.py PROGRAM [--check]

Prints a row a call: processor time and peak memory, the least of several runs, to which other programs on the machine
only add.  With --check: exit code 1 where a call goes beyond its bounds.

Bounds in milliseconds are those of a machine that starts /bin/true in TRUE_MS.  Where a process's pages cost more, as on a
virtual machine whose memory is lent to it page by page (2 ms for /bin/true), they are as many times wider."""
import os
import struct
import subprocess
import sys
import tempfile

RUNS = 7
TRUE_MS = 0.7  # of processor time, for /bin/true
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


def least(program, arguments, folder):
    """-> processor time in ms and peak memory in MB, of a call and its children: the least of several runs."""
    return [min(values) for values in zip(*(run(program, arguments, folder) for _ in range(RUNS)))]


def run(program, arguments, folder):
    child = subprocess.Popen([program, *arguments.split()], cwd=folder, stdout=subprocess.DEVNULL,
                             stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    if status != 0:
        sys.exit(f"{program} {arguments}: exit status {status}")
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
        true_ms = least("/bin/true", "", folder)[0]
        wider = max(true_ms / TRUE_MS, 1)
        print(f"/bin/true takes {true_ms:.2f} ms: bounds of time are {wider:.2f} times as wide.\n")
        print("| call | ms of processor time | MB |\n|---|---|---|")
        for arguments, most_ms, most_mb in CALLS:
            ms, mb = least(program, arguments, folder)
            beyond = (most_ms and ms > most_ms * wider) or (most_mb and mb > most_mb)
            failed += bool(beyond)
            print(f"| `{arguments}` | {ms:.1f} | {mb:.1f} |" + (" beyond its bounds" if beyond else ""))
    return 1 if check and failed else 0


sys.exit(main())
