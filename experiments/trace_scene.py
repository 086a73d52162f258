"""A complete use of fitted materials in a renderer of one's own: spheres on a plane, path traced with OpenCL.

    python experiments/trace_scene.py gold.safetensors out/ceramic -o scene.exr --png scene.png

Each bundle is a sphere on a Lambertian plane, lit by an environment; the kernel is in trace_scene.cl. All that it
takes of jaxbrdf is public: `Collection` puts the materials behind one function, and their numbers into one array.
Samples are added pass by pass; Ctrl-C ends with what is there, and exit code 130.
"""

from __future__ import annotations

import argparse
import math
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyopencl as cl

from jaxbrdf.cli import EXIT_INTERRUPTED, EXIT_MISTAKE, Parser, one_line
from jaxbrdf.core.colour import REC709_LUMINANCE
from jaxbrdf.data import exr, hdr, png
from jaxbrdf.data import input as data_input
from jaxbrdf.data.output import check_writable, write_atomically
from jaxbrdf.errors import DataError, JaxbrdfError, OpenCLError
from jaxbrdf.jobs.source import open_bundle
from jaxbrdf.metrics.image import auto_exposure, tonemap
from jaxbrdf.opencl import Collection
from jaxbrdf.opencl.platform import choose, context_of, describe
from jaxbrdf.opencl.program import build
from jaxbrdf.render.studio import studio

STUDIO = "studio"
KERNEL = Path(__file__).with_suffix(".cl")
DRAWS = {"mis": (1, 1), "light": (1, 0), "brdf": (0, 1)}
"""Directions drawn at each surface by the light and by the material."""

LONGEST_ROW = 3
SPACING, BEHIND = 2.7, 2.3
"""Between the centres of unit spheres along a row, and of rows."""

FIELD_OF_VIEW, ELEVATION = np.radians(24.0), np.radians(17.0)
MARGIN = 1.0
"""The camera: angles in radians over the picture's height and above the spheres, and their size with some room."""

REPORT_SECONDS = 1.0
"""Between two lines of progress."""


@dataclass(frozen=True)
class Options:
    """What to render.

    Attributes:
        bundles: files, or folders of fits, one for each sphere.
        output: linear EXR.
        env: an .hdr or .exr map, or `studio`.
        width, height: pixels.
        samples: a pixel.
        depth: the most surfaces of a path; 1 is direct light.
        seed: of all draws.
        strategy: what draws directions, a key of `DRAWS`.
        floor: the plane's albedo, or None for no plane.
        png: an exposed, sRGB-encoded copy, or None.
    """

    bundles: tuple[str, ...]
    output: str
    env: str = STUDIO
    width: int = 960
    height: int = 540
    samples: int = 64
    depth: int = 3
    seed: int = 0
    strategy: str = "mis"
    floor: float | None = 0.3
    png: str | None = None


class Sky(NamedTuple):
    """Light from all around, all float32.

    Attributes:
        radiance: linear Rec.709, `(H, W, 3)`.
        rows: sums of the rows' probabilities, `(H + 1,)`, from 0 to 1.
        columns: the same along each row, `(H, W + 1)`.
        density: of a direction in each texel, 1/sr, `(H, W)`.
    """

    radiance: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    density: np.ndarray


class Tracer(NamedTuple):
    """The kernel with its buffers, of which the first is the sums that it adds to, and (width, height) in pixels."""

    queue: cl.CommandQueue
    kernel: cl.Kernel
    buffers: list[cl.Buffer]
    size: tuple[int, int]


def load_radiance(name: str) -> np.ndarray:
    """The environment's image `(H, W, 3)`.

    Raises:
        DataError: if it cannot be read, or is no light.
    """
    if name == STUDIO:
        return studio()
    readers = {".hdr": hdr.read, ".exr": exr.read}
    path = Path(name)
    if path.suffix not in readers:
        raise DataError(name, f"is not a light: an .hdr or .exr map, or {STUDIO}")
    radiance = readers[path.suffix](data_input.read(path), path)
    if radiance.min() < 0 or radiance.max() == 0:
        raise DataError(name, "is black or has a negative pixel")
    return radiance


def make_sky(radiance: np.ndarray) -> Sky:
    """Tables to draw a texel by its brightness times its solid angle.

    The kernel's radiance is bilinear: its mean over a texel weighs neighbours 1 : 6 : 1, so no lit spot has density
    zero. The density is that of the rounded sums, which are what is drawn from.
    """
    height, width, _ = radiance.shape
    luminance = radiance.astype(np.float64) @ REC709_LUMINANCE
    across = (np.roll(luminance, 1, 1) + 6.0 * luminance + np.roll(luminance, -1, 1)) / 8.0
    padded = np.pad(across, ((1, 1), (0, 0)), mode="edge")
    mean = (padded[:-2] + 6.0 * across + padded[2:]) / 8.0
    solid_angle = -np.diff(np.cos(np.linspace(0.0, np.pi, height + 1)))[:, None] * (2.0 * np.pi / width)
    columns = cumulative(mean)
    rows = cumulative(np.sum(mean * solid_angle, axis=1))
    chances = np.diff(rows.astype(np.float64))[:, None] * np.diff(columns.astype(np.float64), axis=1)
    return Sky(radiance, rows, columns, (chances / solid_angle).astype(np.float32))


def cumulative(weights: np.ndarray) -> np.ndarray:
    """Sums along the last axis from 0 to 1, `(..., n)` to `(..., n + 1)`; where all weights are zero, even steps."""
    sums = np.cumsum(np.where(weights.sum(-1, keepdims=True) > 0, weights, 1.0), axis=-1)
    sums = np.pad(sums / sums[..., -1:], [(0, 0)] * (sums.ndim - 1) + [(1, 0)])
    return sums.astype(np.float32)


def arrange(count: int) -> np.ndarray:
    """Unit spheres on the plane y = 0 from left to right, `(count, 4)` as centre and radius: a row, or a zigzag."""
    i = np.arange(count)
    zigzag = count > LONGEST_ROW
    x = (0.5 if zigzag else 1.0) * SPACING * (i - 0.5 * (count - 1))
    z = np.where(zigzag & (i % 2 == 0), -BEHIND, 0.0)
    return np.stack([x, np.ones(count), z, np.ones(count)], axis=-1).astype(np.float32)


def look_at(spheres: np.ndarray, aspect: float) -> np.ndarray:
    """A pinhole in front of the spheres and a little above, which sees them all.

    Returns:
        `(4, 3)`: its place, and right, up and forward, the first two as long as half the picture at distance 1.
    """
    low, high = spheres[:, :3].min(axis=0) - 1.0, spheres[:, :3].max(axis=0) + 1.0
    width, height, depth = high - low
    seen = max(height * np.cos(ELEVATION) + depth * np.sin(ELEVATION), width / aspect)
    half = np.tan(0.5 * FIELD_OF_VIEW)
    forward = np.array([0.0, -np.sin(ELEVATION), -np.cos(ELEVATION)])
    up = np.array([0.0, np.cos(ELEVATION), -np.sin(ELEVATION)])
    place = 0.5 * (low + high) - 0.5 * (depth + MARGIN * seen / half) * forward
    return np.stack([place, [half * aspect, 0.0, 0.0], half * up, forward])


def source(options: Options, materials: Collection, sky: Sky) -> str:
    """The program: what the scene has as macros, the materials, and the path tracer."""
    height, width, _ = sky.radiance.shape
    light, material = DRAWS[options.strategy]
    macros = {"SPHERES": len(options.bundles), "SKY_WIDTH": width, "SKY_HEIGHT": height, "DEPTH": options.depth}
    macros |= {"LIGHT_DRAWS": light, "MATERIAL_DRAWS": material}
    if options.floor is not None:
        macros["FLOOR"] = f"{options.floor:.9f}f"
    defined = "".join(f"#define {name} {value}\n" for name, value in macros.items())
    return materials.source + defined + KERNEL.read_text()


def make_tracer(options: Options, camera: np.ndarray, spheres: np.ndarray, context: cl.Context) -> Tracer:
    """The compiled kernel and its buffers, the sums zero.

    Raises:
        JaxbrdfError: if a file cannot be used, or the device refuses.
    """
    materials = Collection.load([open_bundle(name) for name in options.bundles])
    sky = make_sky(load_radiance(options.env))
    kernel = cl.Kernel(build(context, source(options, materials, sky)), "add_sample")
    four = np.pad(camera, ((0, 0), (0, 1)))
    sums = np.zeros((options.height, options.width, 4), np.float32)
    flags = cl.mem_flags.COPY_HOST_PTR
    arrays = [np.ascontiguousarray(a, np.float32) for a in (sums, four, spheres, materials.parameters, *sky)]
    buffers = [cl.Buffer(context, flags, hostbuf=array) for array in arrays]
    return Tracer(cl.CommandQueue(context), kernel, buffers, (options.width, options.height))


def add_passes(tracer: Tracer, samples: int, seed: int, stop: threading.Event) -> int:
    """Adds samples to every pixel until there are enough or `stop` is set; returns how many each was given."""
    start = told = time.perf_counter()
    for done in range(1, samples + 1):
        tracer.kernel(tracer.queue, tracer.size, None, *tracer.buffers, np.uint32(done - 1), np.uint32(seed))
        tracer.queue.finish()
        now = time.perf_counter()
        last = done == samples or stop.is_set()
        if last or now - told >= REPORT_SECONDS:
            rate = done * np.prod(tracer.size) / (now - start) / 1e6
            say(f"{done} of {samples} passes, {rate:.3g} million samples/s, {now - start:.1f} s")
            told = now
        if last:
            break
    return done


def picture(tracer: Tracer, passes: int) -> np.ndarray:
    """The mean of the samples that count, linear Rec.709, `(H, W, 3)`; says so if there were others."""
    width, height = tracer.size
    sums = np.empty((height, width, 4), np.float32)
    cl.enqueue_copy(tracer.queue, sums, tracer.buffers[0])
    lost = passes * width * height - int(sums[..., 3].sum(dtype=np.float64))
    if lost:
        say(f"{lost} of {passes * width * height} samples are NaN or too large: left out")
    return sums[..., :3] / np.maximum(sums[..., 3:], 1.0)


def render(options: Options) -> bool:
    """Renders and writes the files; returns whether all samples were taken.

    Raises:
        JaxbrdfError: if a file cannot be used, or the device refuses.
    """
    for path in filter(None, (options.output, options.png)):
        check_writable(path)
    context = context_of(choose())
    spheres = arrange(len(options.bundles))
    stop = threading.Event()
    try:
        tracer = make_tracer(options, look_at(spheres, options.width / options.height), spheres, context)
        say(f"{options.width} x {options.height} pixels on {describe(context.devices[0])}")
        # a pass that has begun is finished, so that all pixels have as many samples
        signal.signal(signal.SIGINT, lambda *_: stop.set())
        passes = add_passes(tracer, options.samples, options.seed, stop)
        image = picture(tracer, passes)
    except cl.Error as error:
        raise OpenCLError(f"{describe(context.devices[0])} cannot render the scene: {error}") from None
    write_atomically(options.output, exr.write(image))
    if options.png:
        write_atomically(options.png, png.write(tonemap(image, auto_exposure(image))))
    return passes == options.samples


def say(line: str) -> None:
    """One line of progress, on standard error."""
    print(line, file=sys.stderr, flush=True)


def parse(arguments: list[str] | None = None) -> Options:
    """The command line."""
    parser = Parser(prog="trace_scene", description=__doc__.splitlines()[0])
    parser.add_argument("bundles", nargs="+", metavar="BUNDLE", help="a .safetensors file, or the folder of a fit")
    parser.add_argument("-o", "--output", required=True, metavar="SCENE.exr", help="linear Rec.709")
    parser.add_argument("--png", metavar="FILE.png", help="an exposed copy to look at")
    parser.add_argument("--env", default=STUDIO, metavar="MAP", help=f"an .hdr or .exr map, or {STUDIO} (default)")
    parser.add_argument("--width", type=within(int, 1, 2**13), default=Options.width)
    parser.add_argument("--height", type=within(int, 1, 2**13), default=Options.height)
    parser.add_argument("--samples", type=within(int, 1, 2**20), default=Options.samples, help="a pixel (default 64)")
    parser.add_argument("--depth", type=within(int, 1, 2**10), default=Options.depth, help="most surfaces (default 3)")
    parser.add_argument("--seed", type=within(int, 0, 2**31 - 1), default=Options.seed)
    parser.add_argument("--strategy", choices=DRAWS, default=Options.strategy, help="what draws directions")
    parser.add_argument("--floor", type=within(float, 0, 1), default=Options.floor, help="albedo of the plane")
    parser.add_argument("--no-floor", dest="floor", action="store_const", const=None, help="no plane")
    options = parser.parse_args(arguments)
    for path, suffix in ((options.output, ".exr"), (options.png, ".png")):
        if path is not None and Path(path).suffix != suffix:
            parser.error(f"{path!r} must end in {suffix}")
    return Options(**{**vars(options), "bundles": tuple(options.bundles)})


def within(kind: type[int] | type[float], least: float, most: float) -> Callable[[str], float]:
    """A type of argument: a number in a range."""

    def check(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not least <= value <= most:
            name = "whole number" if kind is int else "number"
            raise argparse.ArgumentTypeError(f"{text!r} is not a {name} from {least} to {most}")
        return value

    return check


def main() -> int:
    options = parse()
    try:
        return 0 if render(options) else EXIT_INTERRUPTED
    except JaxbrdfError as error:
        say(f"trace_scene: {one_line(str(error))}")
        return EXIT_MISTAKE
    except KeyboardInterrupt:
        say("trace_scene: interrupted before the first sample")
        return EXIT_INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
