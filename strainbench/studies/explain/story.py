"""The story of a cell: a paragraph, a picture, the frame that failed, and what repeats it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from strainbench.bench.cell import Cell, PluginRef
from strainbench.bench.failure import BEFORE
from strainbench.bench.records import latest_runs, open_folder
from strainbench.bench.runner import Runner, Settings
from strainbench.document import Code, Document
from strainbench.document.writers import markdown
from strainbench.files import write_whole
from strainbench.plugins import UnavailableError
from strainbench.problem.export import write_problem
from strainbench.scenario.scenario import Scenario
from strainbench.studies.explain.choose import Row, cell_of, command, on_frame
from strainbench.studies.explain.picture import draw
from strainbench.studies.explain.place import place
from strainbench.studies.explain.replay import Replay, replay

FRAME, PICTURE, TEXT = "frame.npz", "picture.png", "story.md"
EASIER = 10.0  # times the limit, of a scene that names no easier neighbour
LARGEST = 0.5  # limit of that
MEANING = {
    "says solved and is not": "its status is solved while limits are violated",
    "energy rises": "the step gained energy that nothing put in",
    "momentum not kept": "the projection moved the centre of mass of a free cloth",
    "not a number": "positions are not finite",
    "feasible, not optimal": "limits are kept, the gap to the optimum is not closed",
}


@dataclass(frozen=True)
class Story:
    """What there is to say, line by line, and the files that were written."""

    title: str
    sentences: Sequence[str]
    commands: Sequence[str] = ()
    paths: Sequence[Path] = ()


def explain(row: Row, folder: Path, output: Path, memory_limit_mb: float) -> Story:
    """Play a cell of a folder again to the step where it failed, and tell what happened.

    Parameters
    ----------
    output : a folder for the picture, the frame and the text

    Raises
    ------
    ValueError
        One line: a plug-in that is not there any more.
    """
    title = f"{row['scenario']} {row['resolution']}, {row['solver']}"
    if row["outcome"] == "optimal":
        return Story(title, [f"{title}: optimal on every step; there is no failure to explain."])
    if row["failure"] in BEFORE:
        return Story(title, [f"{title}: {row['failure']}. {_sentence(row['reason'])}"])
    try:
        cell = cell_of(row)
    except UnavailableError as error:
        return Story(title, [f"{title}: {row['reason']}; and here {error}."])
    with TemporaryDirectory() as scratch:
        until = int(row["failure_step"]) if row["failure_step"] else None
        found = replay(cell, until, Path(scratch), memory_limit_mb)
        easier = _easier(cell, folder, Path(scratch) / "easier", memory_limit_mb)
    story = _told(cell, row, found, easier)
    return _written(story, cell, found, output)


def _told(cell: Cell, row: Row, found: Replay, easier: str) -> Story:
    """The story without its files."""
    kind = str(found.row["failure"])
    if not kind:
        again = f"Played again it is optimal up to step {found.row['steps_done']}: what failed then"
        return Story(cell.title, [f"{cell.title}: {row['reason']}.", f"{again} does not repeat."])
    since = found.row["failure_step"]
    time = found.step.get("time", "")
    clock = f" (t = {float(str(time)):.3g} s)" if time not in ("", 0.0) else ""
    meaning = f": {MEANING[kind]}" if kind in MEANING else ""
    begun = f" since step {since} of {row['steps_asked']}{clock}" if since else ""
    reason, _, _ = str(found.row["reason"]).partition("; it says")
    sentences = [f"{cell.title}: {kind}{begun}{meaning}.", _sentence(reason)]
    if found.problem is not None and found.positions is not None:
        sentences.append(place(found.problem, found.positions, kind).sentence)
    if "status" in found.step:
        said = f"The solver says {found.step['status']!r}"
        sentences.append(f"{said} after {found.step['iterations']} iterations.")
    whole = f"{row['projections'] or 0} projections {row['projections_optimal'] or 0} are optimal"
    sentences.append(f"In the whole run, of {whole}.")
    if row["failure"] and row["failure"] != kind:
        sentences.append(f"In the results it was: {row['failure']}.")
    repeats = replace(cell, steps=int(str(since or cell.steps)))
    return Story(cell.title, [*sentences, easier], [command(repeats)])


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


def _easier(cell: Cell, folder: Path, scratch: Path, memory_limit_mb: float) -> str:
    """Whether the cell passes with one setting easier, from the folder or measured."""
    scene = cell.scenario.scenario()
    neighbour = scene.easier() or _wider(scene)
    if neighbour is None:
        return "There is no easier neighbour."
    ref = PluginRef.of(neighbour, cell.scenario.path)
    easy = replace(cell, scenario=ref)
    mine, theirs = scene.parameters, neighbour.parameters
    apart = ", ".join(f"{k} {theirs[k]}" for k in mine if mine[k] != theirs[k])
    row = latest_runs(folder).get(easy.key)
    source = "in the same results" if row else "measured now"
    if row is None:
        Runner(Settings(scratch, memory_limit_mb=memory_limit_mb)).run([easy])
        (row,) = latest_runs(scratch).values()
    better = row["outcome"] in ("optimal", "feasible")
    verdict = "it is this setting that it fails" if better else "it is not this setting alone"
    kind = f" ({row['failure']})" if row["failure"] else ""
    return f"The easier neighbour, {apart}, is {row['outcome']}{kind}, {source}: {verdict}."


def _wider(scene: Scenario) -> Scenario | None:
    """The scene with a limit EASIER times as wide."""
    limit = min(LARGEST, EASIER * scene.limit)
    return replace(scene, limit=limit) if limit > scene.limit else None


def _written(story: Story, cell: Cell, found: Replay, output: Path) -> Story:
    """The story with its files, and the command that solves the frame alone."""
    open_folder(output)
    paths, commands = [], list(story.commands)
    if found.problem is not None:
        about = f"{cell.scenario.label}, projection {found.number}, asked by {cell.solver.label}"
        write_problem(found.problem, output / FRAME, "npz", about)
        paths.append(output / FRAME)
        commands.append(on_frame(cell, output / FRAME))
        paths.append(draw(cell, found, output / PICTURE))
    blocks = [" ".join(story.sentences), *map(Code, commands)]
    write_whole(output / TEXT, markdown(Document(story.title, blocks)).encode())
    return Story(story.title, story.sentences, commands, [*paths, output / TEXT])
