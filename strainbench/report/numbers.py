"""Numbers as text."""

from __future__ import annotations


def power(value: float) -> str:
    """One digit and a power of ten, as in 3e-9; 0 is 0."""
    digit, _, exponent = f"{value:.0e}".partition("e")
    return f"{digit}e{int(exponent)}" if int(exponent or 0) else digit
