"""Static equilibrium under limits: the minimum of the energy, one projection a step.

minimise E(x) = W(x) + gravity  subject to  x in C, the limits and the pins.

Repeating step-and-project does not find it: at its fixed point the step and the projection undo
each other, which is no minimum of E. What is missing is a memory of what the projection pushed
back. The alternating direction method of multipliers (Boyd et al. 2011, section 5; the
Douglas-Rachford splitting, whose reflection is that of SAR) has it: from z in C and u = 0, in the
norm of the masses M, with h a pseudo time step,

1. x = argmin g.x + 1/2 (x - z).H (x - z) + 1/2 ||x - z + u||_M^2 / h^2,
   g = grad E(z) and H its clamped Hessian: an implicit Euler step, of one Newton iteration
2. z' = projection of r x + (1 - r) z + u, with over-relaxation r (section 3.4.3)
3. u' = r x + (1 - r) z + u - z'
4. residuals x - z' and z' - z are balanced (section 3.4.1): h falls where the first leads, and u
   is scaled by the change of h^2

M u' / h^2 is a normal of C at z' in the projection's own norm: the forces G^T Y of the limits. So
with any h the fixed point has grad E(z) + G^T Y = 0, the conditions of a constrained minimum, and
their residual at z' is known without a further solve; started with z and u of such a point, it
stays there. Minimising E itself in 1 does not converge:
cloth under compression is not convex, and the clamped model is. Neither is there a proof for a
non-convex E, nor one minimum: what is found depends on the start.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.physics.body import Body


@dataclass(frozen=True)
class StaticsSettings:
    """All but the relaxation tuned on the drape at 10 and 20 cells."""

    step: float = 0.1  # [s], h of the first steps
    relaxation: float = 1.6  # Boyd et al. 2011: 1.5 to 1.8 improve convergence
    balance_every: int = 5  # steps
    balance_above: float = 2.0  # ratio of the residuals
    balance_by: float = 1.5  # factor on h
    shortest: float = 3e-3  # [s]
    longest: float = 0.3  # [s]


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """An approximate constrained minimum.

    Attributes
    ----------
    positions : (n, 3) [m], as the projection returned them
    limit_forces : (n, 3) [N], G^T Y of the limits: -grad E at a minimum
    residual : ||(grad E + G^T Y)_free|| / (g_0 ||m||_2), relative to the weight
    energies : by name [J], gravity's among them
    """

    positions: FloatArray
    limit_forces: FloatArray
    residual: float
    energies: dict[str, float]


def constrained_minimum(
    body: Body,
    start: FloatArray,
    project: Callable[[FloatArray], FloatArray],
    settings: StaticsSettings,
    limit_forces: FloatArray | None = None,
) -> Iterator[Equilibrium]:
    """Approach a minimum of the potential under limits, step by step.

    Parameters
    ----------
    start : (n, 3) within the limits [m]; its pinned vertices stay where they are
    project : onto the limits, in the norm of the body's masses
    limit_forces : (n, 3) at the start [N], or None for none
    """
    free, M, h, r = body.pattern.free, body.mass[:, None], settings.step, settings.relaxation
    z = start.copy()
    u = np.zeros_like(start) if limit_forces is None else h**2 * limit_forces / M
    gradient, linear = body.potential(z)[1], body.linear_solver
    count = 0
    while True:
        linear.factorise(body.hessian_values(z, body.mass / h**2))
        x = z.copy()  # 1
        x[free] -= linear.solve((gradient + M * u / h**2)[free].ravel()).reshape(-1, 3)
        before, relaxed = z, r * x + (1 - r) * z
        z = project(relaxed + u)  # 2
        u = relaxed + u - z  # 3
        forces = M * u / h**2
        energies, gradient = body.potential(z)
        residual = float(np.linalg.norm((gradient + forces)[free])) / body.force_scale
        yield Equilibrium(z, forces, residual, energies)
        count += 1
        if count % settings.balance_every == 0:  # 4
            apart = float(np.sum(M * (x - z) ** 2) ** 0.5)
            moved = float(np.sum(M * (z - before) ** 2) ** 0.5)
            new = balanced(h, apart, moved, settings)
            u *= (new / h) ** 2
            h = new


def balanced(h: float, apart: float, moved: float, settings: StaticsSettings) -> float:
    """The next pseudo time step, from the two residuals."""
    if apart > settings.balance_above * moved:
        return max(h / settings.balance_by, settings.shortest)
    if moved > settings.balance_above * apart:
        return min(h * settings.balance_by, settings.longest)
    return h
