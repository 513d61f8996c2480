"""Builds the compiled part of the Python package with CMake; pyproject.toml says the rest.

CMAKE_ARGS holds what CMake should know beside: CMAKE_ARGS=-DSQUINT_SIMD_TARGETS=AVX2 pip install --no-build-isolation .
SQUINT_BUILD names a folder that is configured with -DSQUINT_PYTHON=ON: what is built there is taken.
"""

import os
import pathlib
import re
import shlex
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parent


class BuildWithCMake(build_ext):
    def build_extension(self, ext):
        package = pathlib.Path(self.get_ext_fullpath(ext.name)).resolve().parent
        build = os.environ.get("SQUINT_BUILD")
        if build is None:
            build = ROOT / "build" / "python"
            switches = ["-DCMAKE_BUILD_TYPE=Release", "-DSQUINT_PYTHON=ON", "-DSQUINT_TESTS=OFF", "-DSQUINT_BENCH=OFF"]
            switches += [f"-DPython3_EXECUTABLE={sys.executable}", *shlex.split(os.environ.get("CMAKE_ARGS", ""))]
            subprocess.run(["cmake", "-S", ROOT, "-B", build, "-G", "Ninja", *switches], check=True)
        targets = ["squint_python", "squint_pictures", "squint-read"]
        subprocess.run(["cmake", "--build", build, "--target", *targets], check=True)
        subprocess.run(
            ["cmake", "--install", build, "--component", "python", "--prefix", package.parent], check=True
        )


version = re.search(r"project\(squint VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
setup(version=version, ext_modules=[Extension("squint._squint", [])], cmdclass={"build_ext": BuildWithCMake})
