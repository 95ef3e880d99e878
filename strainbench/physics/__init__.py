"""The cloth that is stepped between projections: energies, implicit Euler, integrators."""
