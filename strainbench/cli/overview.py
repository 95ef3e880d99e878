"""What `strainbench --help` shows, as each verb's own help looks.

Typer draws that with what reads Markdown and colours source code: a third of the time that it took.
"""

from __future__ import annotations

from collections.abc import Iterable

from typer import Context
from typer.core import TyperGroup

from strainbench.cli.display import console
from strainbench.escape import terminal


class Verbs(TyperGroup):
    """The verbs, and how they are listed."""

    def format_help(self, ctx: Context, formatter: object) -> None:  # type: ignore[override]  # noqa: ARG002
        """Usage, options, commands."""
        usage = " ".join([ctx.command_path, *self.collect_usage_pieces(ctx)])
        console.print("\n [bold yellow]Usage:[/]", terminal(usage))
        console.print(f"\n {self.help}\n")
        records = (param.get_help_record(ctx) for param in self.get_params(ctx))
        _panel("Options", (record for record in records if record))
        _panel("Commands", ((name, c.help or "") for name, c in self.commands.items()))


def _panel(title: str, entries: Iterable[tuple[str, str]]) -> None:
    from rich.panel import Panel
    from rich.table import Table

    grid = Table.grid("name", "about", padding=(0, 2, 0, 0))
    grid.columns[0].style, grid.columns[0].no_wrap = "bold cyan", True
    for name, about in entries:
        grid.add_row(terminal(name), terminal(" ".join(about.split("\n\n")[0].split())))
    console.print(Panel(grid, title=title, title_align="left", border_style="dim"))
