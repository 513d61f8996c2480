"""pip installs the package with nothing but this machine: python3 pip_test.py SOURCE BUILD.

BUILD is configured with SQUINT_PYTHON: what is built there is installed, and a copy of what pip reads of SOURCE is
built from, since pip writes beside it.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

SOURCE, BUILD = pathlib.Path(sys.argv[1]), sys.argv[2]
USE = """
import pathlib, squint, sys
assert pathlib.Path(squint.__file__).is_relative_to(sys.argv[1]), squint.__file__
picture = squint.render("@lee_shin/figure_5", image={"width": 16, "height": 16})
assert picture["rgba"].shape == (16, 16, 4) and picture["rgba"].max() > 0
import numpy
from PIL import Image
slices = pathlib.Path(sys.argv[1], "slices")
slices.mkdir()
for z in range(8):
    Image.fromarray(numpy.full((8, 8), 25 * z, numpy.uint8)).save(slices / f"{z}.png")
assert squint.plan(slices)["volume"]["dims"] == [8, 8, 8]  # what squint-read and the pictures' module read
"""

with tempfile.TemporaryDirectory() as room:
    source, venv = pathlib.Path(room, "source"), pathlib.Path(room, "venv")
    subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", venv], check=True)
    python = venv / "bin/python3"
    source.mkdir()
    for name in "setup.py", "pyproject.toml", "README.md", "CMakeLists.txt":
        shutil.copy(SOURCE / name, source)
    shutil.copytree(SOURCE / "python", source / "python")
    # A proxy that refuses: whoever asks the network is found out.
    nowhere = "http://127.0.0.1:9"
    environment = {**os.environ, "SQUINT_BUILD": BUILD, "https_proxy": nowhere, "http_proxy": nowhere}
    pip = [sys.executable, "-m", "pip", "--python", python, "--no-cache-dir", "install", "--no-build-isolation", source]
    subprocess.run(pip, check=True, env=environment)
    subprocess.run([python, "-c", USE, room], check=True, env={"PATH": os.environ["PATH"]}, cwd=room)
