"""The command line in this process, which is quicker than one of its own for each word."""

from __future__ import annotations

import sys
from dataclasses import dataclass

from strainbench.cli import app as cli


@dataclass(frozen=True)
class Done:
    returncode: int
    stdout: str
    stderr: str


def command(monkeypatch, capsys, *words, width=200):
    """What `strainbench WORDS` says, and its exit status; its text is as wide as is asked."""
    monkeypatch.setattr(sys, "argv", ["strainbench", *map(str, words)])
    monkeypatch.setattr(cli.console, "width", width)
    capsys.readouterr()
    try:
        cli.main()
    except SystemExit as ended:
        status = ended.code
    said = capsys.readouterr()
    return Done(status, said.out, said.err)
