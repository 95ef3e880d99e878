"""The site from what is there: sections of the README and CONTRIBUTING, docstrings, results.

A page says `{{ README.md: Use }}` where it wants a section, which stays where it is written, and
`{{ list: face }}` where it wants a list that is made here. Links between files of the repository
become links between pages. The pages of methods, scenes, rooms, examples and results are made here,
so that files may come and move without a word in docs/.
"""

from __future__ import annotations

import ast
import logging
import posixpath
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import projection  # beside this file, which mkdocs sees to
from markdown.extensions.toc import slugify
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parent.parent
LOG = logging.getLogger("mkdocs.hooks")
LOCAL = "results/local"
INTRO = "Introduction"  # what stands above the first section
ROOM = "::: strainbench.{}\n    options: {{ heading_level: 1, show_root_full_path: true }}\n"
WANTED = re.compile(r"^\{\{ (\S+): (.+) \}\}$", re.MULTILINE)
LINK = re.compile(r"(?<=\]\()([^)\s#]*)(#[^)\s]*)?(?=\))")


def sections(file: str) -> dict[str, str]:
    """The text below each heading of the second level; code blocks have none."""
    parts, title, code = {INTRO: ""}, INTRO, False
    for line in (ROOT / file).read_text().splitlines(keepends=True):
        code ^= line.startswith("```")
        if line.startswith("## ") and not code:
            title = line[3:].strip()
            parts[title] = ""
        elif not line.startswith("# ") or code:
            parts[title] += line
    return parts


def slug(title: str) -> str:
    """As in an address."""
    return str(slugify(title, "-"))


HOWTO = {title: f"howto/{slug(title)}.md" for title in sections("CONTRIBUTING.md")}
HOWTO[INTRO] = "howto/develop.md"
EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.py"))


def plugins(package: str) -> dict[str, Path]:
    """The file of each solver or scene, by what its page is called."""
    files = [p for p in sorted((ROOT / package).glob("*.py")) if p.stem != "__init__"]
    folders = [p for p in sorted((ROOT / package).iterdir()) if (p / "__init__.py").exists()]
    return {path.stem.replace("_", "-"): path for path in sorted(files + folders)}


def rooms() -> list[str]:
    """What lies directly in strainbench/."""
    places = [p for p in (ROOT / "strainbench").iterdir() if not p.stem.startswith("__")]
    return sorted(p.stem for p in places if p.suffix == ".py" or (p / "__init__.py").exists())


def classes(path: Path) -> Iterator[str]:
    """The classes of a plug-in that are solvers or scenes: those with a name of their own."""
    module = path / "__init__.py" if path.is_dir() else path
    for node in ast.parse(module.read_text()).body:
        names = [
            t for n in getattr(node, "body", []) if isinstance(n, ast.Assign) for t in n.targets
        ]
        if isinstance(node, ast.ClassDef) and any(ast.unparse(name) == "name" for name in names):
            yield node.name


def plugin_page(package: str, title: str, path: Path) -> str:
    """What a plug-in's docstrings say."""
    module = f"{package}.{path.stem}"
    options = (
        "    options: { show_root_heading: false, show_root_toc_entry: false, members: false }"
    )
    parts = [f"# {title}\n\n::: {module}\n{options}\n"]
    parts += [f"::: {module}.{name}\n    options: {{ members: false }}\n" for name in classes(path)]
    return "\n".join(parts)


def example_page(name: str) -> str:
    """An example as it is."""
    path = ROOT / f"examples/{name}.py"
    return f"# {name.replace('_', ' ').capitalize()}\n\n```python\n{path.read_text()}```\n"


def face() -> str:
    """What `from strainbench import ...` offers."""
    tree = ast.parse((ROOT / "strainbench/__init__.py").read_text())
    (names,) = (
        n.value
        for n in tree.body
        if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) == "__all__"
    )
    public = [str(name) for name in ast.literal_eval(names)]
    return "\n".join(f"- [`{name}`][strainbench.{name}]" for name in public)


def tasks() -> str:
    """What CONTRIBUTING tells how to do."""
    return "\n".join(f"- [{t}]({p.removeprefix('howto/')})" for t, p in HOWTO.items() if t != INTRO)


LISTS = {"face": face, "tasks": tasks}


def made() -> dict[str, str]:
    """Pages by their place in the site."""
    pages = {
        place: f"# {'Develop' if title == INTRO else title}\n\n{{{{ CONTRIBUTING.md: {title} }}}}\n"
        for title, place in HOWTO.items()
    }
    for package, folder in (("solvers", "methods"), ("scenarios", "scenes")):
        for title, path in plugins(package).items():
            pages[f"{folder}/{title}.md"] = plugin_page(package, title, path)
    pages |= {f"examples/{name}.md": example_page(name) for name in EXAMPLES}
    pages |= {f"reference/{room}.md": ROOM.format(room) for room in rooms()}
    pages |= {f"{n.lower()}.md": (ROOT / f"{n}.md").read_text() for n in documents()}
    return pages


def documents() -> list[str]:
    """Whole documents of the repository that are a page each."""
    return [name for name in ("CHANGELOG", "SECURITY") if (ROOT / f"{name}.md").exists()]


def on_config(config: Any) -> Any:
    """The pages' order."""
    howto = [place for title, place in HOWTO.items() if title != INTRO]
    config["nav"] = [
        {"Start": "index.md"},
        {"Use": "use.md"},
        {"Concepts": "concepts.md"},
        {"How to": ["howto/index.md", *howto, HOWTO[INTRO], "howto/figures.md"]},
        {"Examples": ["examples/index.md", *(f"examples/{name}.md" for name in EXAMPLES)]},
        {"Methods": ["methods/index.md", *(f"methods/{name}.md" for name in plugins("solvers"))]},
        {"Scenes": ["scenes/index.md", *(f"scenes/{name}.md" for name in plugins("scenarios"))]},
        {
            "Reference": [
                "reference/index.md",
                *({room: f"reference/{room}.md"} for room in rooms()),
            ]
        },
        {"Results": ["results.md", {"All that was measured": "results/README.md"}]},
        {"About": ["about.md", *(f"{name.lower()}.md" for name in documents())]},
    ]
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made, the picture, and the results that are kept in the repository."""
    for place, text in made().items():
        files.append(File.generated(config, place, content=text))
    files.append(File.generated(config, "projection.svg", content=projection.draw()))
    kept = [path for path in (ROOT / "results").rglob("*") if ROOT / LOCAL not in path.parents]
    for path in (*sorted(kept), ROOT / "LICENSE", ROOT / "CITATION.cff"):
        if path.is_file():
            place = path.relative_to(ROOT).as_posix()
            files.append(File.generated(config, place, abs_src_path=str(path)))
    return files


USED: set[tuple[str, str]] = set()
SOURCES = {"results/README.md": "results", "changelog.md": ".", "security.md": "."}
"""Folders of the repository in which the pages lie that are not of docs/."""


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Sections where they are wanted, and links from page to page."""
    here = page.file.src_uri

    def section(found: re.Match[str]) -> str:
        if found[1] == "list":
            return LISTS[found[2]]()
        USED.add((found[1], found[2]))
        return relinked(sections(found[1])[found[2]], ".", here)

    source = SOURCES.get(here, posixpath.join("docs", posixpath.dirname(here)))
    return WANTED.sub(section, relinked(markdown, source, here))


def on_post_build(**_: Any) -> None:
    """No section of the README may be on no page."""
    for title in sections("README.md"):
        if ("README.md", title) not in USED:
            LOG.warning("README.md: the section %r is on no page", title)


def relinked(text: str, folder: str, here: str) -> str:
    """Text of a file in `folder` of the repository, its links as the page `here` needs them."""

    def link(found: re.Match[str]) -> str:
        address, anchor = found[1], found[2] or ""
        if ":" in address or (not address and folder != "."):
            return found[0]
        place = page_of(
            posixpath.normpath(posixpath.join(folder, address)) if address else "README.md", anchor
        )
        return posixpath.relpath(place, posixpath.dirname(here) or ".") + anchor

    return LINK.sub(link, text)


def page_of(path: str, anchor: str) -> str:
    """Where a file of the repository, or its section, is in the site."""
    folder, _, name = path.partition("/")
    stem = name.split("/")[0].removesuffix(".py")
    if path == "README.md":
        return next((p for t, p in README.items() if f"#{slug(t)}" == anchor), "index.md")
    if path == "CONTRIBUTING.md":
        return next((p for t, p in HOWTO.items() if f"#{slug(t)}" == anchor), "howto/index.md")
    if folder == "docs":
        return name
    if folder in ("solvers", "scenarios") and stem:
        return f"{'methods' if folder == 'solvers' else 'scenes'}/{stem.replace('_', '-')}.md"
    if folder == "strainbench" and stem:
        return f"reference/{stem}.md"
    if folder == "examples":
        return f"examples/{stem or 'index'}.md"
    return {"CHANGELOG.md": "changelog.md", "SECURITY.md": "security.md"}.get(path, path)


def _wanted_by() -> dict[str, str]:
    """The page on which each section of the README is."""
    pages = {
        path.relative_to(ROOT / "docs").as_posix(): path for path in (ROOT / "docs").rglob("*.md")
    }
    return {
        title: place
        for place, path in pages.items()
        for file, title in WANTED.findall(path.read_text())
        if file == "README.md"
    }


README = _wanted_by()
