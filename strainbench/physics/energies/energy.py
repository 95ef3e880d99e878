"""What an energy is: any class with these methods may be in the list of a body."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.pattern import Blocks


class Energy(ABC):
    """A part W(x) of a body's energy, a sum over elements of k vertices each.

    Attributes
    ----------
    name : what its value is reported as; those of equal names are added
    elements : (e, k) vertices whose positions an element's energy depends on
    """

    name: ClassVar[str]
    elements: IntArray

    @abstractmethod
    def add_gradient(self, x: FloatArray, out: FloatArray) -> float:
        """Add the gradient at positions x (n, 3) to `out` (n, 3) [N]; return the energy [J]."""

    @abstractmethod
    def add_hessian(self, x: FloatArray, blocks: Blocks, clamp: bool) -> None:
        """Add each element's Hessian [N/m], or a model of it; positive semidefinite if `clamp`."""

    def value(self, x: FloatArray) -> float:
        """The energy [J] at positions x (n, 3)."""
        return self.add_gradient(x, np.zeros_like(x))
