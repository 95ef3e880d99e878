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
            program, *words = shlex.split(command)
            module = ["-m", program] if program != "python" else []
            subprocess.run([sys.executable, *module, *words], check=False)
    told, files = write_claims(results)
    say(told)
    say(f"written: {', '.join(str(file) for file in files)}")
