"""The state of a fit in a file that is whole at every moment, so that a killed fit goes on with the same bits."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import safetensors
import safetensors.numpy

from jaxbrdf.core.tree import named_leaves, with_leaves
from jaxbrdf.data.output import write_atomically
from jaxbrdf.errors import DataError
from jaxbrdf.fit.loop import FitState

METADATA_KEY = "jaxbrdf-checkpoint"


def save(path: Path, state: FitState, record: dict) -> None:
    """Writes the state and a JSON-able `record` of what it belongs to.

    Raises:
        DataError: if it cannot be written; an older checkpoint is then still there.
    """
    arrays = {name: np.asarray(leaf) for name, leaf in named_leaves(state).items()}
    write_atomically(path, safetensors.numpy.save(arrays, metadata={METADATA_KEY: json.dumps(record)}))


def read_record(path: Path) -> dict:
    """What `save` was told that the state belongs to.

    Raises:
        DataError: if the file is no checkpoint.
    """
    try:
        with safetensors.safe_open(path, framework="numpy") as file:
            text = (file.metadata() or {}).get(METADATA_KEY)
        record = json.loads(text) if text is not None else None
    except (OSError, safetensors.SafetensorError, ValueError) as error:
        raise DataError(path, f"not a checkpoint: {' '.join(str(error).split())}") from None
    if not isinstance(record, dict):
        raise DataError(path, "not a checkpoint of a fit")
    return record


def load(path: Path, like: FitState) -> FitState:
    """The state in a checkpoint, with the structure and shapes of `like`.

    Raises:
        DataError: if the file is no checkpoint, or one of another model.
    """
    try:
        arrays = safetensors.numpy.load(path.read_bytes())
    except (OSError, safetensors.SafetensorError) as error:
        raise DataError(path, f"not a checkpoint: {' '.join(str(error).split())}") from None
    for name, leaf in named_leaves(like).items():
        if name not in arrays or arrays[name].shape != leaf.shape or arrays[name].dtype != leaf.dtype:
            raise DataError(path, f"a checkpoint of another model: {name} does not match")
    return with_leaves(like, arrays)
