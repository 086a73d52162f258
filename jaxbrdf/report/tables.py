"""Results as tables in Markdown, and their places in a page."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

Row = dict[str, Any]


class Column(NamedTuple):
    """One column of a table.

    Attributes:
        key: of a row; a column that no row has is left out.
        title: as it stands above the column.
        format: of a number, such as `.2f`; text stays as it is.
        closing: what the last row makes of the numbers, such as `geometric_mean`; None leaves the cell empty.
    """

    key: str
    title: str
    format: str = ""
    closing: Callable[[Sequence[float]], float] | None = None


def geometric_mean(values: Sequence[float]) -> float:
    """exp of the mean logarithm: ratios average to the same whichever side is the divisor."""
    return math.exp(math.fsum(map(math.log, values)) / len(values))


def markdown(rows: Sequence[Row], columns: Sequence[Column], *, closing: str = "") -> str:
    """The rows as a Markdown table, numbers to the right.

    Args:
        rows: results by column key; a missing one is a dash.
        columns: from left to right.
        closing: the first cell of a last row, made by the columns' `closing`; none if empty.

    Raises:
        ValueError: if there is no row.
    """
    if not rows:
        raise ValueError("rows is empty; a table needs one")
    shown = [column for column in columns if any(column.key in row for row in rows)]
    cells = [[_cell(row.get(column.key), column) for column in shown] for row in rows]
    if closing:
        cells.append([f"**{closing}**", *(_closed(rows, column) for column in shown[1:])])
    rule = ["---:" if column.format else "---" for column in shown]
    return "\n".join(_line(line) for line in ([column.title for column in shown], rule, *cells)) + "\n"


def grouped(rows: Sequence[Row], by: str, columns: Sequence[Column]) -> list[Row]:
    """One row for each value of `by`, in order of appearance; each column's numbers closed over its rows."""
    names = list(dict.fromkeys(row[by] for row in rows))
    groups = {name: [row for row in rows if row[by] == name] for name in names}
    return [{by: name, **_closings(group, columns)} for name, group in groups.items()]


def with_block(page: str, name: str, content: str) -> str:
    """The page with what stands between `<!-- name -->` and `<!-- /name -->` replaced.

    Raises:
        ValueError: if the page has not exactly one such place.
    """
    pattern = re.compile(rf"(<!-- {re.escape(name)} -->\n).*?(<!-- /{re.escape(name)} -->)", re.DOTALL)
    page, count = pattern.subn(lambda found: f"{found[1]}{content}{found[2]}", page)
    if count != 1:
        raise ValueError(f"the page has {count} places for {name}; it must have one")
    return page


def _closings(rows: Sequence[Row], columns: Sequence[Column]) -> Row:
    closing = {column.key: column.closing for column in columns if column.closing is not None}
    values = {key: [row[key] for row in rows if key in row] for key in closing}
    return {key: close(values[key]) for key, close in closing.items() if values[key]}


def _closed(rows: Sequence[Row], column: Column) -> str:
    value = _closings(rows, [column]).get(column.key)
    return "" if value is None else f"**{_cell(value, column)}**"


def _cell(value: Any, column: Column) -> str:
    if value is None:
        return "-"
    return f"{value:{column.format}}" if column.format and not isinstance(value, str) else str(value)


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
