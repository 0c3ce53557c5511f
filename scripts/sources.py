"""Public names of the Python sources, read without importing them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from generated import ROOT

PACKAGES = {"raymortar": ROOT / "python" / "raymortar", "meshes": ROOT / "meshes"}
Definition = ast.ClassDef | ast.FunctionDef


@dataclass(frozen=True)
class Module:
    """A source file by its dotted name."""

    name: str
    tree: ast.Module

    def exported(self) -> list[str]:
        """Names in `__all__`, or the public definitions in their order."""
        for node in self.tree.body:
            if (
                isinstance(node, ast.Assign)
                and ast.unparse(node.targets[0]) == "__all__"
            ):
                return [str(name) for name in ast.literal_eval(node.value)]
        return [
            node.name
            for node in self.tree.body
            if isinstance(node, Definition) and not node.name.startswith("_")
        ]


class Sources:
    """All modules, and where each class and function is defined."""

    def __init__(self) -> None:
        self.modules = dict(_modules())
        self._defined: dict[str, list[tuple[str, Definition]]] = {}
        for module in self.modules.values():
            for node in module.tree.body:
                if isinstance(node, Definition):
                    self._defined.setdefault(node.name, []).append((module.name, node))

    def find(self, dotted: str) -> Definition:
        """The definition of a public name such as ``raymortar.rigid.Sphere``."""
        room, _, name = dotted.rpartition(".")
        found = self._defined.get(name, [])
        own = [node for module, node in found if module == room]
        inner = [node for module, node in found if module.startswith(f"{room}.")]
        nodes = own or inner or [node for _, node in found]
        if not nodes:
            raise SystemExit(f"{dotted} is not in the sources")
        return nodes[0]

    def has(self, name: str) -> bool:
        """Whether a class or a function has this name."""
        return name in self._defined

    def bases(self, node: ast.ClassDef) -> Iterator[ast.ClassDef]:
        """The class and the classes of ours that it derives from, in this order."""
        yield node
        for base in node.bases:
            name = ast.unparse(base).rpartition(".")[2].split("[")[0]
            for _, other in self._defined.get(name, []):
                if isinstance(other, ast.ClassDef):
                    yield from self.bases(other)

    def members(self, node: ast.ClassDef) -> dict[str, tuple[str, ast.FunctionDef]]:
        """Public methods and properties with a docstring, and the name of the class that
        they are of, bases last."""
        found: dict[str, tuple[str, ast.FunctionDef]] = {}
        for one in self.bases(node):
            for member in one.body:
                if isinstance(member, ast.FunctionDef) and not is_setter(member):
                    if not member.name.startswith("_") and ast.get_docstring(member):
                        found.setdefault(member.name, (one.name, member))
        return found

    def initializer(self, node: ast.ClassDef) -> ast.FunctionDef | None:
        """The `__init__` of a class, its own or of a base."""
        for one in self.bases(node):
            for member in one.body:
                if isinstance(member, ast.FunctionDef) and member.name == "__init__":
                    return member
        return None

    def fields(self, node: ast.ClassDef) -> list[ast.AnnAssign]:
        """Fields of a data class, those of bases first."""
        found: dict[str, ast.AnnAssign] = {}
        for one in reversed(list(self.bases(node))):
            if any("dataclass" in ast.unparse(d) for d in one.decorator_list):
                for item in one.body:
                    if isinstance(item, ast.AnnAssign) and is_public(item):
                        found[ast.unparse(item.target)] = item
        return list(found.values())


def _modules() -> Iterator[tuple[str, Module]]:
    for package, folder in PACKAGES.items():
        for path in sorted(folder.rglob("*.py")):
            parts = [package, *path.relative_to(folder).with_suffix("").parts]
            name = ".".join(parts).removesuffix(".__init__")
            yield name, Module(name, ast.parse(path.read_text(encoding="utf-8")))


def is_public(item: ast.AnnAssign) -> bool:
    """Whether a field is one that a user gives or reads."""
    name = ast.unparse(item.target)
    return not name.startswith("_") and "ClassVar" not in ast.unparse(item.annotation)


def is_setter(node: ast.FunctionDef) -> bool:
    """Whether a method sets a property."""
    return any(ast.unparse(d).endswith(".setter") for d in node.decorator_list)


def is_property(node: ast.FunctionDef) -> bool:
    """Whether a method is read as an attribute."""
    names = [ast.unparse(decorator) for decorator in node.decorator_list]
    return any(name in ("property", "cached_property") for name in names)


def signature(node: ast.FunctionDef, is_method: bool) -> str:
    """Arguments and defaults, without types."""
    bare = ast.parse(ast.unparse(node)).body[0]
    assert isinstance(bare, ast.FunctionDef)
    given = bare.args
    for argument in (*given.posonlyargs, *given.args, *given.kwonlyargs):
        argument.annotation = None
    for star in (given.vararg, given.kwarg):
        if star is not None:
            star.annotation = None
    static = any(ast.unparse(d) == "staticmethod" for d in node.decorator_list)
    if is_method and not static:
        first = given.posonlyargs or given.args
        del first[0]
    return f"({ast.unparse(given)})".replace("np.", "").replace("'", '"')
