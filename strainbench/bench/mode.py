"""How a cell is played: closed loop, or fed recorded frames, of all steps or of some.

The words are `simulate`, `replay` and `replay:14-30`.
"""

from __future__ import annotations

from strainbench.options import MOST, shown

SIMULATE, REPLAY = "simulate", "replay"


def replays(mode: str) -> bool:
    """Whether every solver is fed the same recorded frames."""
    return mode.startswith(REPLAY)


def window(mode: str, steps: int) -> tuple[int, int]:
    """The first and the last of the scene's steps that are played or fed.

    >>> window("replay:14-30", 17), window("simulate", 10)
    ((14, 30), (1, 10))
    """
    first = int(mode.partition(":")[2].partition("-")[0] or 1)
    return first, first + steps - 1


def steps_of(mode: str, steps: int | None, duration: float | None) -> int | None:
    """The number of steps that was asked for, in words of the mode or as such.

    Raises
    ------
    ValueError
        One line: two numbers of steps.
    """
    frames = mode.partition(":")[2]
    if not frames:
        return steps
    first, last = map(int, frames.split("-"))
    count = last - first + 1
    if duration is not None or steps not in (None, count):
        other = f"--steps {steps}" if duration is None else f"--duration {duration:g}"
        raise ValueError(f"--frames {frames} and {other}: one of them is valid")
    return count


def checked(mode: str) -> str:
    """The words of a mode, a range in full; ValueError says what is valid."""
    kind, colon, frames = mode.partition(":")
    if kind not in (SIMULATE, REPLAY) or (kind == SIMULATE and colon):
        raise ValueError(f"--mode {shown(mode)}: valid are {SIMULATE}, {REPLAY} and {REPLAY}:14-30")
    return with_frames(kind, frames) if colon else mode


def with_frames(mode: str, frames: str) -> str:
    """The mode in which only the steps A to B of `A-B` are fed.

    Raises
    ------
    ValueError
        One line: no such range, or nothing that is replayed.
    """
    ends = frames.split("-")
    numbers = [int(end) for end in ends if end.isascii() and end.isdigit()]
    if len(numbers) != len(ends) or len(ends) > 2 or not 0 < numbers[0] <= numbers[-1] <= MOST:
        valid = "a whole number above 0 or a range is valid, as in 14-30"
        raise ValueError(f"--frames {shown(frames)}: {valid}")
    if mode != REPLAY:
        raise ValueError(f"--frames {frames} with --mode {shown(mode)}: --mode {REPLAY} is valid")
    return f"{REPLAY}:{numbers[0]}-{numbers[-1]}"
