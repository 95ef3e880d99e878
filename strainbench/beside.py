"""Modules beside a plug-in's file: its own, whatever else has their names.

`mine.py` may say `import helper`, at its head or within a function, where helper.py or helper/ lies
in its folder. Such modules are in `sys.modules` only while something of that folder imports them,
so that two folders may each have a helper.py. The names of the standard library and of our packages
keep their meaning, and so does that of the file itself: `clarabel.py` may import the package.
"""

from __future__ import annotations

import builtins
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

OURS = ("strainbench", "solvers", "scenarios")


class Beside:
    """Finds and keeps the modules of the folder of one plug-in's file."""

    def __init__(self, file: Path) -> None:
        self._file, self._folder = file, file.parent
        self._modules: dict[str, ModuleType] = {}

    def execute(self, module: ModuleType, code: CodeType) -> None:
        """Run the code of a module of the folder, with an `import` that looks there first."""
        module.__dict__["__builtins__"] = vars(builtins) | {"__import__": self._import}
        exec(code, module.__dict__)

    def _import(
        self,
        name: str,
        globals: Mapping[str, object] | None = None,
        locals: Mapping[str, object] | None = None,
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> ModuleType:
        """What `import` does in a module of the folder."""
        package = str((globals or {}).get("__package__") or "") if level else name
        if not self._has(package.partition(".")[0]):
            return builtins.__import__(name, globals, locals, fromlist or (), level)
        with self._visible():
            return builtins.__import__(name, globals, locals, fromlist or (), level)

    def _has(self, top: str) -> bool:
        """Whether a first name means what lies beside."""
        if top in ("", self._file.stem, *OURS) or top in sys.stdlib_module_names:
            return False
        folder = self._folder / top
        return folder.with_name(f"{top}.py").is_file() or (folder / "__init__.py").is_file()

    @contextmanager
    def _visible(self) -> Iterator[None]:
        """The folder's modules in `sys.modules`, others of their names put aside."""
        aside = {name: m for name, m in sys.modules.items() if self._has(name.partition(".")[0])}
        for name in aside:
            del sys.modules[name]
        sys.modules.update(self._modules)
        sys.meta_path.insert(0, self)
        try:
            yield
        finally:
            sys.meta_path.remove(self)
            ours = [name for name in sys.modules if self._has(name.partition(".")[0])]
            self._modules = {name: sys.modules.pop(name) for name in ours}
            sys.modules.update(aside)

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Where a module of the folder lies, as `sys.meta_path` asks; None for all others."""
        if not self._has(name.partition(".")[0]):
            return None
        spec = PathFinder.find_spec(name, path or [str(self._folder)], target)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Loader(self, spec.loader.name, spec.loader.path)
        return spec


class _Loader(SourceFileLoader):
    """Runs a file's code with the folder's own `import`."""

    def __init__(self, beside: Beside, name: str, path: str) -> None:
        super().__init__(name, path)
        self._beside = beside

    def exec_module(self, module: ModuleType) -> None:
        """See `importlib.abc.Loader`."""
        code: Any = self.get_code(module.__name__)
        self._beside.execute(module, code)
