"""Progress on a terminal, on standard error so that results can be piped."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

Tell = Callable[[int, str], None]


class Reporter(Protocol):
    """What a long job tells while it works."""

    def say(self, line: str) -> None:
        """One line of text."""
        ...

    def steps(self, title: str, total: int) -> AbstractContextManager[Tell]:
        """A context whose value is called with (steps done, a note)."""
        ...


class Terminal:
    """A reporter with a progress bar; plain lines where standard error is no terminal."""

    def __init__(self) -> None:
        self.console = Console(stderr=True, highlight=False, soft_wrap=True)

    def say(self, line: str) -> None:
        self.console.print(line, markup=False)

    @contextmanager
    def steps(self, title: str, total: int) -> Iterator[Tell]:
        columns = [TextColumn("{task.description}"), BarColumn(24), TextColumn("{task.percentage:>3.0f}%")]
        columns += [TextColumn("{task.fields[note]}"), TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn()]
        with Progress(*columns, console=self.console) as bar:
            task = bar.add_task(title, total=total, note="")
            yield lambda done, note: bar.update(task, completed=done, note=note)


class Silent:
    """A reporter for machines: says nothing."""

    def say(self, line: str) -> None:
        del line

    @contextmanager
    def steps(self, title: str, total: int) -> Iterator[Tell]:
        del title, total
        yield lambda done, note: None
