"""Vega, Vega-Lite and vega-embed as one script for a page without a network."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

from strainbench.compiled import cache_folder
from strainbench.files import write_whole

SNIPPET = "window.vegaEmbed = vegaEmbed"


def vega_script() -> str:
    """The bundle of vl-convert, which takes seconds to make and is kept on the disk."""
    kept = cache_folder(Path(__file__)).parent / f"vega-{version('vl-convert-python')}.js"
    if not kept.exists():
        import vl_convert

        # Its names would be global ones, `n` and `t` among them.
        script = f"(() => {{{vl_convert.javascript_bundle(SNIPPET)}\n}})()"
        kept.parent.mkdir(parents=True, exist_ok=True)
        write_whole(kept, script.replace("</script", r"<\/script").encode())
    return kept.read_text(encoding="utf-8")
