"""Every energy: its gradient and Hessian against finite differences, and how it adds up."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import runpy
from pathlib import Path

import numpy as np
import pytest

from strainbench.physics import energies
from strainbench.physics.cloth import Cloth, Material
from strainbench.physics.energies.bending import Bending, hinges
from strainbench.physics.energies.contact import Contact, Floor, Penalty, Sphere
from strainbench.physics.energies.corotational import Corotational
from strainbench.physics.energies.energy import Energy
from strainbench.physics.energies.membrane import Membrane
from strainbench.physics.linear import symmetric
from strainbench.physics.pattern import Pattern
from strainbench.problem.elements import shape_gradients
from strainbench.problem.grid import square_grid
from tests.problems import central_difference

Bed = runpy.run_path(str(Path(__file__).parents[2] / "examples/add_an_energy.py"))["Bed"]
REST, ELEMENTS = square_grid(2, 1.0, "alternating")
FLAT = np.insert(REST, 1, 0.0, axis=1)
GRADIENTS, AREAS = shape_gradients(REST, ELEMENTS)
VERTICES = np.arange(len(REST))[:, None]
MASS = np.linspace(1.0, 2.0, len(REST))
TETRAHEDRA = np.array([[0, 1, 3, 4], [1, 2, 4, 5], [4, 5, 7, 8]])  # of rest shapes of their own
CORNERS = np.array([[0.0, 0, 0], [0.6, 0.1, 0], [0, 0.5, 0.2], [0.1, 0, 0.7]]) * np.ones((3, 1, 1))
NO_PINS = np.array([], dtype=np.int64)

ENERGIES = {
    "membrane": Membrane(ELEMENTS, GRADIENTS, 0.1 * AREAS, (2.0, 3.0)),
    "corotational": Corotational(TETRAHEDRA, *shape_gradients(CORNERS, TETRAHEDRA), (2.0, 3.0)),
    "bending": Bending(*hinges(REST, ELEMENTS, AREAS)),
    "floor": Contact(7.0, 0.3, (Floor(-0.2),)).penalty(MASS),
    "sphere": Contact(7.0, 0.3, (Sphere((0.5, -0.2, 0.5), 0.4),)).penalty(MASS),
    "bed": Bed(VERTICES, MASS),
}
MODELS = {"bending": 0.0, "sphere": None}
"""Hessians that are models: by how far from flat they are still exact, None for nowhere."""


@pytest.fixture(params=ENERGIES)
def name(request):
    return request.param


def moved(rng, by=0.1):
    return FLAT + by * rng.normal(size=FLAT.shape)


def gradient(energy, x):
    out = np.zeros_like(x)
    energy.add_gradient(x, out)
    return out


def hessian(energy, x, clamp, pinned=NO_PINS):
    """On the free vertices, and no others coupled than those of an element."""
    pattern = Pattern.of([energy.elements], len(x), pinned)
    data = np.zeros(len(pattern.indices))
    energy.add_hessian(x, *pattern.blocks(data), clamp)
    return symmetric(pattern.matrix(data)).toarray()


def test_every_energy_of_the_suite_is_in_the_list():
    modules = [m.name for m in pkgutil.iter_modules(energies.__path__, energies.__name__ + ".")]
    found = {
        kind
        for module in modules
        for _, kind in inspect.getmembers(importlib.import_module(module), inspect.isclass)
        if issubclass(kind, Energy) and not inspect.isabstract(kind)
    }
    assert (
        {Membrane, Corotational, Bending, Penalty} <= found <= {type(e) for e in ENERGIES.values()}
    )


def test_the_gradient_is_the_derivative_of_the_value(name, rng):
    energy, x = ENERGIES[name], moved(rng)
    expected = central_difference(energy.value, x)
    np.testing.assert_allclose(gradient(energy, x), expected, atol=1e-6 * np.abs(expected).max())
    assert np.abs(expected).max() > 0


def test_the_hessian_is_the_derivative_of_the_gradient(name, rng):
    by = MODELS.get(name, 0.1)
    if by is None:
        pytest.skip("a model everywhere: tests of its own compare it")
    energy, x = ENERGIES[name], moved(rng, by)
    found = hessian(energy, x, clamp=False)
    expected = central_difference(lambda x: gradient(energy, x), x, 1e-5).reshape(found.shape)
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())
    assert np.abs(expected).max() > 0


def test_the_clamped_hessian_has_no_negative_curvature_and_pins_leave_it(name, rng):
    energy, x = ENERGIES[name], moved(rng, 0.3)
    found = hessian(energy, x, clamp=True)
    assert np.linalg.eigvalsh(found).min() >= -1e-12 * np.abs(found).max()
    free = np.delete(np.arange(found.shape[0]).reshape(-1, 3), [1, 4], axis=0).ravel()
    pinned = hessian(energy, x, clamp=True, pinned=np.array([1, 4]))
    np.testing.assert_array_equal(pinned, found[np.ix_(free, free)])


def test_what_is_given_to_a_cloth_is_added_to_its_own(name, rng):
    energy, x = ENERGIES[name], moved(rng)
    own = Cloth(REST, ELEMENTS, Material(), np.array([0]))
    both = Cloth(REST, ELEMENTS, Material(), np.array([0]), more=(energy,))
    values, forces = own.potential(x)
    more, all_forces = both.potential(x)
    assert sum(more.values()) == pytest.approx(sum(values.values()) + energy.value(x))
    assert more[energy.name] == pytest.approx(values.get(energy.name, 0.0) + energy.value(x))
    np.testing.assert_allclose(all_forces, forces + gradient(energy, x), atol=1e-9)
    change = both.pattern.matrix(both.hessian_values(x, MASS)) - own.pattern.matrix(
        own.hessian_values(x, MASS)
    )
    expected = hessian(energy, x, clamp=True, pinned=np.array([0]))
    np.testing.assert_allclose(symmetric(change).toarray(), expected, atol=1e-9)


def test_gravity_is_the_weight(rng):
    x = moved(rng)
    cloth = Cloth(REST, ELEMENTS, Material(), NO_PINS)
    values, forces = cloth.potential(x)
    assert values["gravity"] == pytest.approx(9.81 * np.sum(cloth.mass * x[:, 1]))
    weight = cloth.gradient(x)[1] - forces
    np.testing.assert_allclose(weight, np.outer(cloth.mass, [0.0, -9.81, 0.0]), atol=1e-9)
