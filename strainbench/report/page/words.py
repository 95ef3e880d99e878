"""Numbers and names within sentences."""

from __future__ import annotations

from collections.abc import Sequence

NUMBERS = (
    *("no", "one", "two", "three", "four", "five", "six"),
    *("seven", "eight", "nine", "ten", "eleven", "twelve"),
)


def count(number: int) -> str:
    """A number up to twelve as a word."""
    return NUMBERS[number] if number < len(NUMBERS) else str(number)


def capital(text: str) -> str:
    """With a capital letter."""
    return text[:1].upper() + text[1:]


def listed(names: Sequence[str]) -> str:
    """With commas, and the last after an "and"."""
    *most, last = names or [""]
    return f"{', '.join(most)} and {last}" if most else last
