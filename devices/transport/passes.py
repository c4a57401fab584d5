"""Passes: certificates by which a building's router knows rooms, sites and watchers."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives.serialization import load_pem_private_key
from cryptography.x509.oid import NameOID

from devices.hub.entry.certificates import (
    MAX_PEM_BYTES,
    CertificateError,
    issue_client,
    keep_certificates,
)
from devices.transport.keys import KeyNameError, MemberRole, check_name
from scenes.formats.storage.atomic import write_whole

ROOT_PUBLIC_FILE = "root.crt"
"""Certificate of the building's root, without its key: what the router checks passes by."""

MEMBERS_FILE = "members.txt"
"""File of those who have a pass: a role and a name a line. A line taken out is a pass withdrawn."""

PASSES = "passes"
"""Folder of the passes that were made."""

MAX_MEMBERS = 4096
"""Members of a building, chosen: four times a thousand rooms."""

_BLOCK = re.compile(rb"-----BEGIN ([A-Z ]+)-----\n.*?\n-----END \1-----\n", re.DOTALL)
"""One key or certificate in a file of several."""


class PassError(ValueError):
    """A file that is no pass; says which, and how to get one."""


@dataclass(frozen=True, slots=True, order=True)
class Admitted:
    """A member that has a pass, as the router knows it."""

    role: MemberRole
    name: str

    @property
    def common_name(self) -> str:
        """Of its certificate."""
        return f"{self.role}:{self.name}"


@dataclass(frozen=True, slots=True)
class Pass:
    """A machine's key and certificates.

    Attributes:
        admitted: whose it is.
        key_base64: its private key in PEM, in base64: a secret.
        certificate_base64: its certificate likewise.
        root_base64: the building's root certificate likewise.
    """

    admitted: Admitted
    key_base64: str
    certificate_base64: str
    root_base64: str

    def __repr__(self) -> str:
        """Say whose it is, and nothing of its key."""
        return f"Pass({self.admitted.common_name})"


def keep_building(folder: Path, *, names: Sequence[str]) -> None:
    """Make what a building's router needs, where it is missing: root, its own certificate.

    Args:
        folder: readable by the user alone.
        names: host names and addresses under which the router is reached.

    Raises:
        CertificateError: the folder cannot be written.
    """
    made = keep_certificates(folder, names=names)
    if _read(folder / ROOT_PUBLIC_FILE) != made.root_pem:
        write_whole(folder / ROOT_PUBLIC_FILE, [made.root_pem])


def admit(folder: Path, admitted: Admitted) -> Path:
    """Make a pass, and write its member down; a former pass of the same name stays good.

    Args:
        folder: of the building.
        admitted: for whom.

    Returns:
        The file to take to that machine; whoever has it is that member.

    Raises:
        CertificateError: the folder holds no building, or cannot be written.
        KeyNameError: the name is none.
    """
    check_name(admitted.name)
    known = members(folder)
    root = _read(folder / ROOT_PUBLIC_FILE)
    key_and_certificate = issue_client(folder, common_name=admitted.common_name)
    path = folder / PASSES / f"{admitted.role}-{admitted.name}.pass"
    path.parent.mkdir(mode=0o700, exist_ok=True)
    write_whole(path, [key_and_certificate, root], is_private=True)
    if admitted not in known:
        if len(known) >= MAX_MEMBERS:
            raise PassError(f"{folder / MEMBERS_FILE}: {MAX_MEMBERS} members; take some out")
        write_members(folder, (*known, admitted))
    return path


def members(folder: Path) -> tuple[Admitted, ...]:
    """Return who has a pass.

    Raises:
        PassError: a line of the file is bad.
    """
    path = folder / MEMBERS_FILE
    found: dict[Admitted, None] = {}
    for number, line in enumerate(_read(path).decode("utf-8", "replace").splitlines(), start=1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        try:
            role, name = words
            found[Admitted(MemberRole(role), check_name(name))] = None
        except (ValueError, KeyNameError):
            raise PassError(f"{path}, line {number}: wanted a role and a name") from None
    return tuple(found)


def write_members(folder: Path, those: Sequence[Admitted]) -> None:
    """Write down who has a pass."""
    lines = "".join(f"{each.role} {each.name}\n" for each in those)
    write_whole(folder / MEMBERS_FILE, [lines.encode()], is_private=True)


def read_pass(path: Path) -> Pass:
    """Return the pass in a file.

    Raises:
        PassError: it holds none.
    """
    data = _read(path)
    blocks = [(found[1], found[0]) for found in _BLOCK.finditer(data)]
    keys = [block for kind, block in blocks if kind.endswith(b"PRIVATE KEY")]
    certificates = [block for kind, block in blocks if kind == b"CERTIFICATE"]
    if len(keys) != 1 or len(certificates) != 2:
        raise PassError(f"{path}: no pass; `nexus sites admit` makes one where the router is")
    try:
        load_pem_private_key(keys[0], None)
        subject = x509.load_pem_x509_certificate(certificates[0]).subject
        common = str(subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)
        role, _, name = common.partition(":")
        admitted = Admitted(MemberRole(role), check_name(name))
    except (ValueError, IndexError):
        raise PassError(f"{path}: a damaged pass; make a new one") from None
    key, certificate, root = (
        base64.b64encode(block).decode() for block in (keys[0], *certificates)
    )
    return Pass(admitted, key, certificate, root)


def _read(path: Path) -> bytes:
    """Return a small file; nothing where there is none."""
    try:
        if path.stat().st_size > MAX_PEM_BYTES * 4:
            raise CertificateError(f"{path}: too large, at most {4 * MAX_PEM_BYTES} bytes")
        return path.read_bytes()
    except FileNotFoundError:
        return b""
