"""squint: fixed-point volume ray casting with every bit of every stage a setting.

    import squint
    picture = squint.render("head.toml", precision={"preset": "squeeze"})
    picture["rgba"]                 # float32 [row, column, RGBA], premultiplied, linear light
    picture["record"]["hash"]       # as `squint render --json` has it: the same bits

A scene is a TOML file, @NAME of one that comes with squint, a volume file that makes a scene of its own, a text of TOML
with a line break in it, or None: the built-in head, or, where there is a volume, a scene that its data make.  Settings
are the scene's keys: `sampling={"step": 0.5}` or `**{"sampling.step": 0.5}`; the last wins.

Where a call takes `volume`, it is an array [z, y, x] of integers or floats in native or foreign byte order, in place of
the scene's own; `spacing` and `origin` are (x, y, z) in world units.  A C-contiguous uint8 or uint16 array is not
copied, but where its end meets the end of a page of memory; it must not change during a call.  Other types become
levels as a file's do (docs/formats.md).  The interpreter's lock is released while squint works; Ctrl-C ends a call.

What squint refuses is a ValueError with the program's own line.
"""

from __future__ import annotations

import csv as _csv
import io as _io
import json as _json
import os as _os
import pathlib as _pathlib
from typing import TYPE_CHECKING, Any

from . import _squint

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Number", "compare", "pixel", "plan", "render", "rows", "sweep", "tables", "version"]

Triple = tuple[float, float, float]
_ONES: Triple = (1.0, 1.0, 1.0)
_ZEROS: Triple = (0.0, 0.0, 0.0)
_CONFIGS = str(_pathlib.Path(__file__).with_name("configs"))


def _toml(value: Any) -> str:
    if hasattr(value, "tolist"):  # arrays and scalars of numpy
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    return _json.dumps(_os.fspath(value))


def _settings(settings: dict[str, Any], before: str = "") -> list[str]:
    texts: list[str] = []
    for key, value in settings.items():
        if isinstance(value, dict):
            texts += _settings(value, f"{before}{key}.")
        else:
            texts.append(f"{before}{key}={_toml(value)}")
    return texts


def _input(
    scene: str | _os.PathLike[str] | None,
    volume: NDArray[Any] | None,
    spacing: Triple,
    origin: Triple,
    settings: dict[str, Any],
) -> _squint.Input:
    if isinstance(settings.get("volume"), dict):
        raise TypeError('volume is an array; settings of the scene\'s volume are "volume.KEY"')
    name = "" if scene is None else _os.fspath(scene)
    return _squint.Input(name, _CONFIGS, _settings(settings), volume, spacing, origin)


def version() -> str:
    """"0.1.0", as `squint --version`."""
    return _squint.version()


def render(
    scene: str | _os.PathLike[str] | None = None,
    *,
    volume: NDArray[Any] | None = None,
    spacing: Triple = _ONES,
    origin: Triple = _ZEROS,
    threads: int = 0,
    layout: str = "auto",
    error: bool = False,
    reference: bool = False,
    audit: bool = False,
    frame: int = 0,
    **settings: Any,
) -> dict[str, Any]:
    """Renders a scene.

    error: measure against the same scene in double, as squint render --error does; reference: against the exact integral
    along each ray; audit: count what every wire carried.  threads 0 is one a processor; frame: of a turntable.
    layout: how voxels lie for the fast path: "linear" (as they are), "cells" (blocks of their own, faster), or "auto":
    cells where something is visible and half of the free memory holds them.  The picture is the same.

    Returns a dict:
      rgba    float32 [row, column, 4], row 0 on top, premultiplied by alpha, linear light
      Z, Z.mean, N.x ...   float32 [row, column] for each output.* that is set: world units from the eye's plane, ...
      fixed.R ...          int32 [row, column], the raw words, with output.fixed
      record  dict: time, samples, path, memory, hash, errors, wires and more (docs/json.md)
    """
    arrays, record = _squint.render(
        _input(scene, volume, spacing, origin, settings), threads, layout, error, reference, audit, frame
    )
    arrays["record"] = _json.loads(record)
    return arrays


def plan(
    scene: str | _os.PathLike[str] | None = None,
    *,
    volume: NDArray[Any] | None = None,
    spacing: Triple = _ONES,
    origin: Triple = _ZEROS,
    frame: int = 0,
    **settings: Any,
) -> dict[str, Any]:
    """What a scene exercises: stages, wires and their formats, tables, memory in bytes, notes and warnings.

    The dict is `squint plan --json` (docs/json.md).
    """
    return _json.loads(_squint.plan(_input(scene, volume, spacing, origin, settings), frame))


def pixel(
    column: int,
    row: int,
    scene: str | _os.PathLike[str] | None = None,
    *,
    volume: NDArray[Any] | None = None,
    spacing: Triple = _ONES,
    origin: Triple = _ZEROS,
    **settings: Any,
) -> dict[str, Any]:
    """Every value on every wire along one pixel's ray, in the order it was computed; column 0 is left, row 0 on top.

    Returns columns of one length: slab (int64; -1 before the first), wire (names), raw (int64; 0 where nothing is
    rounded), value and exact (float64, in the wire's own units), and rgba, float64 [4].
    """
    return _squint.pixel(_input(scene, volume, spacing, origin, settings), column, row)


def tables(
    scene: str | _os.PathLike[str] | None = None,
    *,
    volume: NDArray[Any] | None = None,
    spacing: Triple = _ONES,
    origin: Triple = _ZEROS,
    **settings: Any,
) -> list[dict[str, Any]]:
    """The tables of a scene's stages: dicts of wire (a name or None) and words (int64 [entry, column], or
    [front, back, RGBA] for pi2d), raw in the wire's format."""
    return _squint.tables(_input(scene, volume, spacing, origin, settings))


def compare(
    a: NDArray[Any] | str | _os.PathLike[str], b: NDArray[Any] | str | _os.PathLike[str], *, srgb: bool = False
) -> dict[str, Any]:
    """Differences of two pictures: two files, or two arrays [row, column, channel] of 1 to 4 of R, G, B, A.

    Returns {"all": ..., "foreground": ...}, by channel and "RGB": psnr in dB (None where identical), rmse_lsb8,
    bias_lsb8 and max_error_lsb8 in 1/255 of full scale.  srgb encodes R, G and B first.
    """
    if hasattr(a, "shape") and hasattr(b, "shape"):
        return _json.loads(_squint.compare_arrays(a, b, srgb))
    return _json.loads(_squint.compare_files(_os.fspath(a), _os.fspath(b), srgb))


def _columns(text: str) -> dict[str, Any]:
    import numpy

    def column(cells: list[str]) -> Any:
        for kind in (int, float):
            try:
                return numpy.array([kind(cell) if cell or kind is int else numpy.nan for cell in cells])
            except ValueError:
                pass
        return cells

    names, *lines = _csv.reader(_io.StringIO(text))
    return {name: column([line[i] for line in lines]) for i, name in enumerate(names)}


def sweep(
    file: str | _os.PathLike[str], output: str | _os.PathLike[str], *, threads: int = 0, **settings: Any
) -> dict[str, Any]:
    """Renders every point of a sweep file into the folder `output`; points that are there are not computed again.

    `file` may be @NAME of a sweep that comes with squint.  Settings stand under the file's axes, as --set does.

    Returns columns of one length, as `squint report --format csv`: the axes, then the figures of each point.  Numbers
    are arrays (int64, or float64 with NaN where a point has none), words are lists.  Errors are in 1/255 of full scale.
    """
    return _columns(_squint.sweep(_os.fspath(file), _CONFIGS, _settings(settings), _os.fspath(output), threads))


def rows(run: str | _os.PathLike[str]) -> dict[str, Any]:
    """The points of a folder that a sweep filled, as sweep() returns them."""
    return _columns(_squint.rows(_os.fspath(run)))


class Number:
    """A fixed-point number: a format, a rounding and an overflow rule, and a word of it.

    Number("u1.15 trn", 0.7) rounds once.  a + b, a - b and a * b are exact and rounded once, to a's spec; an operand
    that is no Number is rounded to a's format first.  to("u1.8 rnd") converts.
    """

    __slots__ = ("spec", "format", "raw", "value", "decimal", "hex", "bits", "error_last_bits", "inexact", "overflow")

    spec: str
    format: str
    raw: int
    value: float
    decimal: str  # every digit
    hex: str
    bits: str
    error_last_bits: float  # of the operation that made it, in units of its last bit
    inexact: bool
    overflow: bool

    def __init__(self, spec: str, value: float | int | str = 0) -> None:
        """value: a number, or "#22938" and "0x599a" for raw words."""
        self._take([spec, value if isinstance(value, str) else repr(value)])

    def _take(self, words: list[str]) -> Number:
        for name, item in _squint.calculate(words).items():
            setattr(self, name, item)
        return self

    def _operand(self, other: Any) -> list[str]:
        if isinstance(other, Number):
            return [other.format, f"#{other.raw}"]
        return [self.format, repr(other)]

    def _apply(self, operation: str, left: list[str], right: list[str]) -> Number:
        return object.__new__(Number)._take([self.spec, operation, *left, *right])

    def __add__(self, other: Any) -> Number:
        return self._apply("add", self._operand(self), self._operand(other))

    def __sub__(self, other: Any) -> Number:
        return self._apply("sub", self._operand(self), self._operand(other))

    def __mul__(self, other: Any) -> Number:
        return self._apply("mul", self._operand(self), self._operand(other))

    def __radd__(self, other: Any) -> Number:
        return self._apply("add", self._operand(other), self._operand(self))

    def __rsub__(self, other: Any) -> Number:
        return self._apply("sub", self._operand(other), self._operand(self))

    def __rmul__(self, other: Any) -> Number:
        return self._apply("mul", self._operand(other), self._operand(self))

    def to(self, spec: str) -> Number:
        """The same number in another spec: rounded, then limited."""
        return object.__new__(Number)._take([spec, "add", *self._operand(self), self.format, "#0"])

    def __float__(self) -> float:
        return self.value

    def __eq__(self, other: object) -> bool:
        return self.value == (other.value if isinstance(other, Number) else other)

    def __lt__(self, other: Any) -> bool:
        return self.value < float(other)

    def __hash__(self) -> int:
        return hash(self.value)

    def __repr__(self) -> str:
        return f'Number("{self.spec}", {self.decimal})'
