"""Fits that take a second, and the command line in this process."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from jaxbrdf import cli
from jaxbrdf.fit.loop import LoopConfig
from jaxbrdf.fit.presets import PRESETS

TINY = dataclasses.replace(
    PRESETS["quick"](), name="tiny", steps=600, pool=2**14, loop=LoopConfig(batch=512, microbatch=128, ema=0.02)
)
"""Four pieces a device, so that gradients are accumulated, and a pool that is read many times."""


LONG = dataclasses.replace(TINY, name="long", steps=4000)
"""Takes long enough to be stopped in the middle."""


class Listener:
    """A reporter that keeps what it is told, and may act on it.

    Attributes:
        lines: said.
        notes: (step, note) of the progress.
    """

    def __init__(self, act: Any = None) -> None:
        self.lines: list[str] = []
        self.notes: list[tuple[int, str]] = []
        self.act = act

    def say(self, line: str) -> None:
        self.lines.append(line)

    @contextmanager
    def steps(self, title: str, total: int) -> Iterator[Any]:
        del title, total
        yield self._tell

    def _tell(self, done: int, note: str) -> None:
        self.notes.append((done, note))
        if self.act is not None:
            self.act(done)


def run_json(capsys: Any, *arguments: object) -> dict[str, Any]:
    """What a command that succeeds prints for machines: one JSON object and nothing else."""
    assert cli.run([*map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)
