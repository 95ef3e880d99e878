"""A document as one self-contained HTML page."""

from __future__ import annotations

from functools import cache

from jinja2 import Environment, PackageLoader, Template
from markdown_it import MarkdownIt
from markupsafe import Markup, escape

from strainbench.document import Code, Document, Faint, Picture, Prose, Strong, blocks
from strainbench.escape import plain


def page(document: Document) -> str:
    """The page; pictures are drawings in SVG and inlined, nothing is fetched."""
    return _template().render(title=document.title, blocks=list(blocks(document)))


@cache
def _template() -> Template:
    environment = Environment(
        loader=PackageLoader("strainbench.document", "."),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"inline": _inline, "drawing": _drawing, "kind": _kind}
    return environment.get_template("page.html")


def _kind(block: object) -> str:
    """Of what class a block is; a text is a text, however it is marked."""
    return "str" if isinstance(block, str) else type(block).__name__


def _inline(text: str) -> Markup:
    """Text of whatever kind."""
    if isinstance(text, Prose):
        return Markup(MarkdownIt("commonmark", {"html": False}).renderInline(text))
    words = escape(plain(text))
    tags = {Code: "code", Strong: "strong", Faint: "small"}
    tag = next((tag for kind, tag in tags.items() if isinstance(text, kind)), "")
    return Markup(f"<{tag}>{words}</{tag}>") if tag else words


def _drawing(picture: Picture) -> Markup:
    svg = picture.path.read_text(encoding="utf-8")
    return Markup(svg[svg.index("<svg") :])
