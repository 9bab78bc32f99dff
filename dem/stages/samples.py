"""What a run writes down at its samples, column by column."""

from collections.abc import Mapping
from typing import Any

import numpy as np


class Samples:
    """Columns of a record, an entry for every sample.

    Parameters
    ----------
    shapes : of an entry of each
    """

    def __init__(self, **shapes: tuple[int, ...]) -> None:
        self.shapes = shapes
        self.columns: dict[str, list[Any]] = {name: [] for name in shapes}

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def add(self, **entry: Any) -> None:
        """Write a sample down."""
        for name, values in self.columns.items():
            values.append(entry[name])

    def take_up(self, arrays: Mapping[str, Any]) -> None:
        """Go on with the samples of a run before, from arrays as :meth:`arrays` gives them."""
        self.columns = {name: list(arrays[name]) for name in self.columns}

    def arrays(self) -> dict[str, Any]:
        """All samples of every column, shape (samples, ...)."""
        every = self.columns.items()
        return {name: np.array(values).reshape(len(values), *self.shapes[name]) for name, values in every}
