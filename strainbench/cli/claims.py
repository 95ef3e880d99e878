"""The verb claims: what papers claim, beside what was measured."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

from strainbench.cli.display import say
from strainbench.cli.options import AuditFolder, MeasureClaims


def audit_claims(
    results: AuditFolder = Path("results"),
    measure: MeasureClaims = False,
) -> None:
    """Set each claim of the papers beside what the folders of results hold, with a verdict."""
    from strainbench.report.claims.written import missing, write_claims

    if measure:
        for command in missing(results):
            say(command)
            subprocess.run(_words(command), check=False)
    told, files = write_claims(results)
    say(told)
    say(f"written: {', '.join(str(file) for file in files)}")


def _words(command: str) -> list[str]:
    """A command as it is called: strainbench and python are those that run now."""
    program, *words = shlex.split(command)
    ours = {"strainbench": [sys.executable, "-m", "strainbench"], "python": [sys.executable]}
    return [*ours.get(program, [program]), *words]
