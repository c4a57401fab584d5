import json
import shutil

import pytest

from studio.web import web_files
from studio.web.web_files import WEB, MissingWebFilesError, module_source, web_modules

LOCKED = ("package.json", "package-lock.json", ".npmrc")


@pytest.fixture
def bare(tmp_path):
    """The folder of a fresh checkout."""
    for name in LOCKED:
        shutil.copy(WEB / name, tmp_path / name)
    return tmp_path


def test_without_a_network_it_says_what_to_do(bare, monkeypatch):
    monkeypatch.setenv("npm_config_offline", "true")
    monkeypatch.setenv("npm_config_cache", str(bare / "cache"))
    said = []

    with pytest.raises(MissingWebFilesError, match="connect to the network once") as error:
        web_modules(said.append, web=bare)

    assert str(bare / "node_modules") in str(error.value)
    assert len(said) == 1


def test_outside_a_checkout_it_says_so(tmp_path):
    with pytest.raises(MissingWebFilesError, match="made by a checkout of the program"):
        web_modules(print, web=tmp_path)


def test_what_is_there_is_used_and_another_version_is_fetched_again(bare, modules, monkeypatch):
    shutil.copytree(WEB / "node_modules", bare / "node_modules")
    fetched = []
    monkeypatch.setattr(web_files, "fetch", fetched.append)

    web_modules(print, web=bare)
    assert fetched == []

    package = bare / "node_modules" / "three" / "package.json"
    package.write_text(package.read_text().replace('"version": "0.187.0"', '"version": "0.186.0"'))
    web_modules(print, web=bare)
    assert fetched == [bare]


def test_no_address_is_in_the_lock_file_and_every_package_has_its_digest():
    lock = (WEB / "package-lock.json").read_text()
    packages = json.loads(lock)["packages"]

    assert "http" not in lock
    assert packages.pop("")["devDependencies"] == {
        "@types/three": "0.187.0",
        "@types/webxr": "0.5.24",
        "axe-core": "4.14.1",
        "iwer": "2.5.0",
        "typescript": "5.9.3",
    }
    assert all(package["integrity"].startswith("sha512-") for package in packages.values())
    # Libraries of the pages, and what only tests use.
    assert [package.get("dev", False) for package in packages.values()].count(False) == 3


def test_modules_import_each_other_by_names_that_a_page_can_map(modules):
    for path in modules.values():
        source = module_source(path)
        assert b"from './" not in source
        assert b'from "./' not in source
