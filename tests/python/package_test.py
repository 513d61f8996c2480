"""The Python package against the program: python3 package_test.py SQUINT SOURCE.  PYTHONPATH names the package."""

import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import threading
import time
import unittest

PROGRAM, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
SMALL = {"image.width": 40, "image.height": 30, "volume.dims": 24}
FUNCTION = {
    "transfer_function.points": [[0, 0, 0.2, 0.9, 0], [200, 1, 0.8, 0.5, 0.7]],
    "transfer_function.unit_distance": 1,
}


def program(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True)


def as_flags(settings):
    return [word for key, value in settings.items() for word in ("--set", f"{key}={json.dumps(value)}")]


class StartUp(unittest.TestCase):
    def test_import_takes_less_than_a_fifth_of_a_second(self):
        code = "import time; t = time.process_time(); import squint; print(time.process_time() - t)"
        least = min(float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(5))
        self.assertLess(least, 0.2)


class Render(unittest.TestCase):
    def test_the_words_are_the_programs(self):
        record = json.loads(program("render", "--json", "-", "-q", *as_flags(SMALL)).stdout)
        picture = squint.render(**SMALL)
        self.assertEqual(picture["record"]["hash"], record["pictures"][0]["hash"])
        self.assertEqual(picture["record"]["wires"], record["wires"])
        self.assertEqual((picture["rgba"].shape, picture["rgba"].dtype), ((30, 40, 4), np.float32))
        self.assertTrue((picture["rgba"][..., :3].max(axis=2) <= picture["rgba"][..., 3]).all(), "premultiplied")

    def test_channels_come_by_name_and_words_as_words(self):
        picture = squint.render(**SMALL, output={"depth": True, "fixed": True})
        self.assertEqual(picture["Z"].shape, (30, 40))
        fraction = int(re.search(r"\.(\d+)", picture["record"]["wires"]["color"]["format"]).group(1))
        np.testing.assert_array_equal(picture["fixed.R"] / np.float32(1 << fraction), picture["rgba"][..., 0])

    def test_an_array_is_the_file_it_was_written_to(self):
        voxels = (np.arange(9 * 10 * 11) % 201).astype(np.uint8).reshape(9, 10, 11)  # z, y, x
        with tempfile.TemporaryDirectory() as folder:
            voxels.tofile(f"{folder}/v.raw")
            stored = {"volume.file": f"{folder}/v.raw", "volume.dims": [11, 10, 9], "volume.type": "u8"}
            more = {**FUNCTION, "image.width": 20, "image.height": 20, "volume.spacing": [1, 2, 1.5]}
            record = json.loads(program("render", "--json", "-", "-q", *as_flags({**stored, **more})).stdout)
        del more["volume.spacing"]
        for array in (voxels, np.asfortranarray(voxels), voxels[:, :, ::-1][:, :, ::-1]):
            picture = squint.render(volume=array, spacing=(1, 2, 1.5), **more)
            self.assertEqual(picture["record"]["hash"], record["pictures"][0]["hash"])
            self.assertEqual(picture["record"]["volume"]["hash"], record["volume"]["hash"])

    def test_floats_are_quantised_to_their_window(self):
        voxels = np.linspace(0, 1, 8 * 8 * 8, dtype=np.float32).reshape(8, 8, 8)
        plan = squint.plan(volume=voxels, **FUNCTION, **{"volume.window": [0, 1], "volume.bits": 10})
        self.assertEqual(plan["volume"]["dims"], [8, 8, 8])
        self.assertTrue(any("10 bits" in note for note in plan["notes"]), plan["notes"])

    def test_what_is_refused_is_a_value_error_with_the_programs_line(self):
        with self.assertRaises(ValueError) as caught:
            squint.render(sampling={"stepp": 1})
        self.assertEqual(program("render", "--set", "sampling.stepp=1").stderr, f"squint: {caught.exception}\n")
        # What the plan refuses is said with the place of the setting, too.
        with self.assertRaises(ValueError) as caught:
            squint.plan(**SMALL, precision={"sample": "u1.4"})
        words = as_flags({**SMALL, "precision.sample": "u1.4"})
        self.assertEqual(program("plan", *words).stderr, f"squint: {caught.exception}\n")
        with self.assertRaises(ValueError) as caught:
            squint.render("@lee_shin/figur_5")
        self.assertEqual(program("render", "@lee_shin/figur_5").stderr, f"squint: {caught.exception}\n")
        with self.assertRaisesRegex(ValueError, r"shape \(3, 3\)"):
            squint.render(volume=np.zeros((3, 3), np.uint8))
        with self.assertRaisesRegex(ValueError, "complex128"):
            squint.render(volume=np.zeros((3, 3, 3), complex))
        for name, value in ("threads", -1), ("frame", 1), ("layout", "cubes"):
            with self.assertRaisesRegex(ValueError, f"^{name}: found .*{value}.*; allowed: "):
                squint.render(**{name: value}, **SMALL)
        with self.assertRaisesRegex(ValueError, "spacing is 0"):
            squint.render(volume=np.zeros((3, 3, 3), np.uint8), spacing=(0, 1, 1))

    def test_types_are_those_of_files(self):
        whole = np.arange(6 * 7 * 8, dtype=np.int64).reshape(6, 7, 8) - 100
        for kind in ("int16", ">i2", "int32", "uint64", "int64", "float32", "float64"):
            voxels = (whole + 100 if kind == "uint64" else whole).astype(kind)
            with tempfile.TemporaryDirectory() as folder:
                voxels.tofile(f"{folder}/v.raw")
                name = np.dtype(kind).kind + str(8 * voxels.itemsize)
                stored = {"volume.file": f"{folder}/v.raw", "volume.dims": [8, 7, 6], "volume.type": name}
                if kind.startswith(">"):
                    stored["volume.endian"] = "big"
                line = program("plan", "--json", *as_flags({**FUNCTION, **stored}))
                self.assertEqual(line.returncode, 0, line.stderr)
                of_file = json.loads(line.stdout)["volume"]
            of_array = squint.plan(volume=voxels, **FUNCTION)["volume"]
            self.assertEqual({**of_array, "name": ""}, {**of_file, "name": ""}, kind)

    def test_an_array_alone_makes_a_scene_as_a_file_does(self):
        z, y, x = np.mgrid[:24, :24, :24] - 11.5
        ball = (255 * np.exp(-(x * x + y * y + z * z) / 40)).astype(np.uint8)
        with tempfile.TemporaryDirectory() as folder:
            header = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 24 24 24\nencoding: raw\n\n"
            pathlib.Path(folder, "ball.nrrd").write_bytes(header.encode() + ball.tobytes())
            size = {"image.width": 24, "image.height": 24}
            line = program("render", f"{folder}/ball.nrrd", "--json", "-", "-q", *as_flags(size))
            self.assertEqual(line.returncode, 0, line.stderr)
            record = json.loads(line.stdout)
            picture = squint.render(volume=ball, **size)
            self.assertGreater(picture["rgba"].max(), 0.1)
            self.assertEqual(picture["record"]["hash"], record["pictures"][0]["hash"])
            self.assertEqual(squint.render(f"{folder}/ball.nrrd", **size)["record"]["hash"], picture["record"]["hash"])
            # In place of a scene's own volume, wherever that may be.
            scene = "[volume]\nfile = '${NO_SUCH_VARIABLE}/v.nrrd'\n[image]\nwidth = 24\nheight = 24\n"
            points = "[transfer_function]\nunit_distance = 1\npoints = [[0, 1, 1, 1, 0], [255, 1, 1, 1, 0.5]]\n"
            self.assertGreater(squint.render(scene + points, volume=ball)["rgba"].max(), 0.1)

    def test_an_array_may_change_between_calls(self):
        voxels = np.zeros((40, 40, 40), np.uint8)
        voxels[5:15] = 180
        small = {**FUNCTION, "image.width": 20, "image.height": 20}
        first = squint.render(volume=voxels, **small)["record"]["hash"]
        voxels[:] = voxels[::-1].copy()
        second = squint.render(volume=voxels, **small)["record"]["hash"]
        self.assertNotEqual(first, second)
        self.assertEqual(second, squint.render(volume=voxels.copy(), **small)["record"]["hash"])

    def test_control_c_ends_a_call(self):
        code = """
import signal, squint, threading, time
threading.Timer(0.5, lambda: signal.raise_signal(signal.SIGINT)).start()
begun = time.monotonic()
try:
    squint.render(reference=True, image={"width": 2000, "height": 2000})
    print("went through")
except KeyboardInterrupt:
    print("interrupted" if time.monotonic() - begun < 60 else "late")
"""
        out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        self.assertEqual((out.returncode, out.stdout), (0, "interrupted\n"), out.stderr)

    def test_two_threads_render_at_once_and_the_lock_is_free(self):
        hashes, spans, ticks = [], [], 0
        big = {**SMALL, "image.width": 480, "image.height": 360}

        def work():
            begun = time.monotonic()
            hashes.append(squint.render(threads=1, reference=True, **big)["record"]["hash"])
            spans.append((begun, time.monotonic()))

        workers = [threading.Thread(target=work) for _ in range(2)]
        for worker in workers:
            worker.start()
        while any(worker.is_alive() for worker in workers):
            ticks += 1  # a held lock would leave this loop standing
            time.sleep(0.001)
        self.assertEqual((len(hashes), len(set(hashes))), (2, 1))
        self.assertLess(max(begin for begin, _ in spans), min(end for _, end in spans), "one after the other")
        self.assertGreater(ticks, 5)

    def test_voxels_are_not_copied(self):
        voxels = np.full((512, 512, 512), 7, np.uint16)
        voxels[100:110] = 900
        before = resident()
        squint.plan(volume=voxels, **FUNCTION)
        self.assertLess(resident() - before, voxels.nbytes // 8)
        squint.render(volume=voxels, layout="linear", **FUNCTION, **{"image.width": 16, "image.height": 16})
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        self.assertLess(peak, before + voxels.nbytes // 2)

    def test_an_array_that_ends_with_its_page_is_copied(self):
        page = os.sysconf("SC_PAGESIZE")
        with tempfile.TemporaryDirectory() as folder:
            np.full(page * 4, 200, np.uint8).tofile(f"{folder}/v.raw")
            mapped = np.memmap(f"{folder}/v.raw", np.uint8, "r", shape=(4, page // 64, 64))
            record = squint.render(volume=mapped, **FUNCTION, **{"image.width": 16, "image.height": 16})["record"]
            held = np.array(mapped)
            plain = squint.render(volume=held, **FUNCTION, **{"image.width": 16, "image.height": 16})["record"]
            self.assertEqual(record["hash"], plain["hash"])


def resident():
    return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


class Others(unittest.TestCase):
    def test_plan_and_tables(self):
        plan = squint.plan(**SMALL, classification={"method": "pips", "order": 2})
        self.assertEqual(len(plan["stages"]), 6)
        self.assertGreater(plan["memory"]["table_bytes"], 0)
        tables = squint.tables(**SMALL, classification={"method": "pi2d", "table_size": 64})
        self.assertTrue(any(table["words"].shape == (64, 64, 4) for table in tables))

    def test_pixel_ends_at_the_pictures_colour(self):
        trace, picture = squint.pixel(20, 15, **SMALL), squint.render(**SMALL)
        np.testing.assert_array_equal(trace["rgba"].astype(np.float32), picture["rgba"][15, 20])
        self.assertEqual(len(trace["wire"]), len(trace["raw"]))
        self.assertIn("transparency", trace["wire"])

    def test_compare_takes_arrays_and_files(self):
        a, b = squint.render(**SMALL)["rgba"], squint.render(**SMALL, precision={"preset": "squeeze"})["rgba"]
        self.assertIsNone(squint.compare(a, a)["all"]["RGB"]["psnr"])
        with tempfile.TemporaryDirectory() as folder:
            for name, preset in ("a", "default"), ("b", "squeeze"):
                program("render", "-q", "-o", f"{folder}/{name}.exr", *as_flags({**SMALL, "precision.preset": preset}))
            self.assertEqual(squint.compare(a, b), squint.compare(f"{folder}/a.exr", f"{folder}/b.exr"))

    def test_a_sweep_is_columns(self):
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "s.toml").write_text(
                "[[axis]]\nkey = 'sampling.step'\nvalues = [1, 0.5, 2]\n", encoding="utf-8"
            )
            rows = squint.sweep(f"{folder}/s.toml", f"{folder}/run", **SMALL)
            np.testing.assert_array_equal(rows["sampling.step"], [1, 0.5, 2])
            self.assertEqual(set(map(len, rows.values())), {3})
            self.assertTrue((rows["real color rmse"] > 0).all())
            self.assertEqual(rows["status"], ["done"] * 3)
            again = squint.rows(f"{folder}/run")
            self.assertEqual(list(again), list(rows))
            for name, column in rows.items():
                np.testing.assert_array_equal(again[name], column)

    def test_numbers_are_the_calculators(self):
        a = squint.Number("u1.15 trn", 0.7)
        self.assertEqual((a.raw, a.hex), (22937, "0x5999"))
        product = a * a
        line = program("number", "u1.15 trn", "mul", "u1.15", "#22937", "u1.15", "#22937").stdout
        self.assertIn(f"raw     {product.raw}\n", line)
        self.assertTrue(product.inexact)
        self.assertEqual(float(a.to("u1.8 rnd")), round(a.value * 256) / 256)
        self.assertEqual((a + 0.25 - 0.25).raw, a.raw)
        with self.assertRaisesRegex(ValueError, "number: "):
            squint.Number("u99.15", 1)

    def test_the_pages_example_draws(self):
        page = (SOURCE / "docs/python.md").read_text(encoding="utf-8")
        code = re.search(r"```python\n(.*?)```", page, re.S).group(1)
        if subprocess.run([sys.executable, "-c", "import matplotlib"], capture_output=True).returncode != 0:
            self.skipTest("matplotlib is not installed")
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "configs").symlink_to(SOURCE / "configs")
            done = subprocess.run(
                [sys.executable, "-c", code],
                cwd=folder,
                env={**os.environ, "MPLBACKEND": "Agg", "PATH": f"{pathlib.Path(PROGRAM).parent}:{os.environ['PATH']}"},
                capture_output=True,
                text=True,
            )
            self.assertEqual(done.returncode, 0, done.stderr)
            pictures = list(pathlib.Path(folder).glob("*.png"))
            self.assertEqual(len(pictures), 1)
            self.assertGreater(pictures[0].stat().st_size, 10000)
            keep = os.environ.get("SQUINT_KEEP")
            if keep:
                pathlib.Path(keep).write_bytes(pictures[0].read_bytes())

    def test_every_function_has_a_docstring(self):
        for name in squint.__all__:
            self.assertTrue(getattr(squint, name).__doc__, name)


import numpy as np  # noqa: E402

import squint  # noqa: E402

if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
