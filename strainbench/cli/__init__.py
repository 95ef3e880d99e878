"""The command line."""

from strainbench.cli.app import main

__all__ = ["main"]
