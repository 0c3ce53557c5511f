"""Pack a wheel from what CMake has installed, where there is no scikit-build-core.

    python3 packaging/wheel.py TREE FOLDER

TREE has the compiled module in raymortar/, and gets the rest of the package; the wheel is
written to FOLDER. It has the same files and metadata as pip's.
"""

import shutil
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[1]


def metadata(project):
    """Text of METADATA, from the table [project] of pyproject.toml."""
    lines = [
        "Metadata-Version: 2.1",
        f"Name: {project['name']}",
        f"Version: {project['version']}",
        f"Summary: {project['description']}",
        f"Keywords: {','.join(project['keywords'])}",
        f"Requires-Python: {project['requires-python']}",
        *(f"Classifier: {name}" for name in project["classifiers"]),
        *(f"Requires-Dist: {name}" for name in project["dependencies"]),
    ]
    for extra, names in project["optional-dependencies"].items():
        lines.append(f"Provides-Extra: {extra}")
        lines += [f"Requires-Dist: {name}; extra == '{extra}'" for name in names]
    lines += ["Description-Content-Type: text/markdown", ""]
    return "\n".join([*lines, (SOURCE / project["readme"]).read_text()])


def pack(tree, folder):
    """Add Python files and metadata to a tree, and pack it."""
    project = tomllib.loads((SOURCE / "pyproject.toml").read_text())["project"]
    skip = shutil.ignore_patterns("__pycache__")
    package = SOURCE / "python" / "raymortar"
    shutil.copytree(package, tree / "raymortar", dirs_exist_ok=True, ignore=skip)
    info = tree / f"{project['name']}-{project['version']}.dist-info"
    info.mkdir()
    shutil.copy(SOURCE / project["license"]["file"], info)
    (info / "METADATA").write_text(metadata(project))
    python = "cp{}{}".format(*sys.version_info)
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    (info / "WHEEL").write_text(
        "Wheel-Version: 1.0\nGenerator: raymortar\nRoot-Is-Purelib: false\n"
        f"Tag: {python}-{python}-{platform}\n"
    )
    command = [sys.executable, "-m", "wheel", "pack", tree, "--dest-dir", folder]
    subprocess.run(command, check=True)


if __name__ == "__main__":
    pack(*map(Path, sys.argv[1:]))
