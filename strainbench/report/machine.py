"""Where something was measured."""

from __future__ import annotations

from collections.abc import Mapping

from strainbench.document import Document


def machine_section(machines: Mapping[str, Mapping[str, object]]) -> Document:
    """A line a machine."""
    return Document("Machine", [machine_line(*about) for about in machines.items()])


def machine_line(name: str, facts: Mapping[str, object]) -> str:
    """A machine and its facts in one line."""
    packages = facts.get("packages")
    versions = packages.items() if isinstance(packages, Mapping) else ()
    return (
        f"{name}: {facts['memory_gb']} GB, {facts['system']}, Python {facts['python']}, "
        f"{facts['threads_per_solver']} thread a solver; "
        + ", ".join(f"{package} {version}" for package, version in versions)
    )
