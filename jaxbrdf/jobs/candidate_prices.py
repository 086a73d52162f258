"""What candidates cost before they are fitted: kept with a search, so that a resumed one goes on as it would have."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyopencl as cl

from jaxbrdf.data.output import write_atomically
from jaxbrdf.jobs import price
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.fitting import unfitted
from jaxbrdf.jobs.folder import make_folder
from jaxbrdf.jobs.price import Price
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.opencl.platform import describe, identity

FILE = "prices.json"


def candidate_prices(
    folder: Path, candidates: Sequence[Candidate], context: cl.Context, *, isotropic: bool, reporter: Reporter
) -> dict[str, Price]:
    """Prices by name: those that the folder keeps, if they are of these candidates on this device, or new ones.

    Raises:
        OpenCLError: if the device refuses a candidate.
        DataError: if they cannot be kept.
    """
    device, names = context.devices[0], [candidate.name for candidate in candidates]
    record = {"device": identity(device), "isotropic": isotropic, "candidates": names}
    kept = _read(folder / FILE)
    if all(kept.get(name) == value for name, value in record.items()):
        return {name: Price(*of) for name, of in kept["prices"].items()}
    reporter.say(f"timing {len(names)} candidates on {describe(device)}")
    bundles = {candidate.name: unfitted(candidate, isotropic=isotropic) for candidate in candidates}
    prices = price.opencl_prices(bundles, context, reporter=reporter)
    make_folder(folder)
    write_atomically(folder / FILE, json.dumps({**record, "prices": prices}, indent=1).encode())
    return prices


def forget_prices(folder: Path) -> None:
    """Removes them where nothing was fitted, and the folder with them."""
    if [path.name for path in folder.iterdir()] == [FILE]:
        (folder / FILE).unlink()
        folder.rmdir()


def _read(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
