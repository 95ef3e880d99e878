"""A part of a document as HTML, to stand in a page; pictures that are drawings are inlined."""

from __future__ import annotations

import base64
from functools import cache
from mimetypes import guess_type

from jinja2 import Environment, PackageLoader, Template
from markdown_it import MarkdownIt
from markupsafe import Markup, escape

from strainbench.document import Code, Document, Faint, Part, Picture, Prose, Strong, blocks
from strainbench.escape import plain

STYLE = """
body { max-width: 62em; margin: 0 auto; padding: 20px 24px 60px; color: #202124;
  font: 15px/1.5 "Helvetica Neue", Helvetica, Arial, "Liberation Sans", sans-serif;
  overflow-wrap: break-word; }
h1, h2 { font-weight: 400; } h3 { font-size: 15px; margin: 30px 0 4px; }
.scroll { overflow-x: auto; } th, td { padding: 3px 10px; text-align: left; }
.right { text-align: right; }
code { font-size: 13px; overflow-wrap: anywhere; }
"""


def html(part: Part, level: int = 1) -> Markup:
    """The part, its titles from this level on; nothing is fetched."""
    return Markup(_template().render(blocks=list(blocks(part, level))))


def page(document: Document) -> str:
    """A file of its own, which needs nothing beside it."""
    form = Markup(
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<link rel="icon" href="data:,">\n<title>{}</title>\n<style>{}</style>\n</head>\n'
        "<body>\n{}</body>\n</html>\n"
    )
    return str(form.format(document.title, Markup(STYLE), html(document)))


def inline(text: str) -> Markup:
    """Text of whatever kind."""
    if isinstance(text, Prose):
        return Markup(MarkdownIt("commonmark", {"html": False}).renderInline(text))
    words = escape(plain(text))
    tags = {Code: "code", Strong: "strong", Faint: "small"}
    tag = next((tag for kind, tag in tags.items() if isinstance(text, kind)), "")
    return Markup(f"<{tag}>{words}</{tag}>") if tag else words


def templates(package: str) -> Environment:
    """Those of a package, whose values are escaped."""
    loader = PackageLoader(package, ".")
    return Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)


@cache
def _template() -> Template:
    environment = templates("strainbench.document")
    environment.filters |= {"inline": inline, "drawing": _drawing, "kind": _kind}
    return environment.get_template("part.html")


def _kind(block: object) -> str:
    """Of what class a block is; a text is a text, however it is marked."""
    return "str" if isinstance(block, str) else type(block).__name__


def _drawing(picture: Picture) -> Markup:
    """An SVG as it is, another picture as data."""
    if picture.path.suffix == ".svg":
        svg = picture.path.read_text(encoding="utf-8")
        return Markup(svg[svg.index("<svg") :])
    kind, data = guess_type(picture.path)[0], base64.b64encode(picture.path.read_bytes()).decode()
    return Markup('<img src="data:{};base64,{}" alt="{}">').format(kind, data, plain(picture.about))
