"""The hub's own certificates: a root that headsets install once, a leaf for this machine."""

from __future__ import annotations

import ipaddress
import os
import socket
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from scenes.formats.storage.atomic import write_whole

ROOT_FILE, LEAF_FILE = "root.pem", "leaf.pem"
"""Key and certificate in one file, so that both are of the same moment whatever happens."""

ROOT_LIFE = timedelta(days=3650)
"""Life of the root, ten years: installing it on a headset is a chore."""

LEAF_LIFE = timedelta(days=90)
"""Life of the leaf; chosen: short, as it renews itself."""

CLIENT_LIFE = timedelta(days=365)
"""Life of a machine's certificate by which it is let in, a year; it is made anew by hand."""

RENEW_BEFORE = timedelta(days=30)
"""Rest of a leaf's life at which it is made anew."""

CLOCK_SLACK = timedelta(days=1)
"""Certificates begin so long ago: a headset's clock may be slow."""

MAX_PEM_BYTES = 64 * 1024
"""Length of a file that is read as certificates."""

LOCAL_DOMAINS = ("localhost", "local", "lan", "home.arpa", "internal")
"""Domains of local networks: the root is good for names under these and the machine's own alone, so
that nobody who steals its key can pretend to be a site of the internet."""


class CertificateError(OSError):
    """Certificates cannot be made or read; says which file, and what to do."""


@dataclass(frozen=True, slots=True)
class Certificates:
    """A machine's certificates.

    Attributes:
        root_pem: certificate to install on headsets; no secret.
        leaf_file: key and chain of this machine, as TLS loads them.
    """

    root_pem: bytes
    leaf_file: Path


@dataclass(frozen=True, slots=True)
class _Pair:
    key: ec.EllipticCurvePrivateKey
    certificate: x509.Certificate


def keep_certificates(
    folder: Path, *, names: Sequence[str], now: datetime | None = None
) -> Certificates:
    """Return certificates for a machine; what is missing, too old or for other names is made.

    Args:
        folder: where they are kept, readable by the user alone.
        names: host names and addresses under which the machine is reached.
        now: time of day; None for the computer's.

    Raises:
        CertificateError: the folder cannot be written, or holds something else.
    """
    moment = datetime.now(UTC) if now is None else now
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        root = _read(folder / ROOT_FILE)
        leaf = _read(folder / LEAF_FILE)
        if root is None or root.certificate.not_valid_after_utc - moment < LEAF_LIFE:
            root, leaf = _new_root(moment), None
            _write(folder / ROOT_FILE, root)
        if leaf is None or not _is_good(leaf, root, names=names, now=moment):
            leaf = _new_leaf(root, names, now=moment)
            _write(folder / LEAF_FILE, leaf)
    except OSError as error:
        raise CertificateError(
            f"certificates in {folder}: {error.strerror or error}; choose a folder you may write"
        ) from error
    return Certificates(
        root.certificate.public_bytes(serialization.Encoding.PEM), folder / LEAF_FILE
    )


def issue_client(folder: Path, *, common_name: str, now: datetime | None = None) -> bytes:
    """Return a new key and certificate, in PEM, for a machine that connects to another.

    Args:
        folder: of the root that signs it, as `keep_certificates` made it.
        common_name: by which it is known.
        now: time of day; None for the computer's.

    Raises:
        CertificateError: there is no root.
    """
    moment = datetime.now(UTC) if now is None else now
    root = _read(folder / ROOT_FILE)
    if root is None:
        raise CertificateError(f"certificates in {folder}: no {ROOT_FILE}; make one first")
    key = ec.generate_private_key(ec.SECP256R1())
    client = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.CLIENT_AUTH])
    unsigned = _signed_by(root, key, common_name=common_name, lasts=CLIENT_LIFE, now=moment)
    certificate = unsigned.add_extension(client, critical=False).sign(root.key, hashes.SHA256())
    return b"".join(_pem(_Pair(key, certificate)))


def lan_addresses() -> tuple[str, ...]:
    """Return this machine's own addresses, the one towards the network first; nothing is sent."""
    found: list[str] = []
    for family, far in ((socket.AF_INET, "192.0.2.1"), (socket.AF_INET6, "2001:db8::1")):
        with suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((far, 9))  # of a datagram socket: looks the route up, sends nothing
            found.append(str(probe.getsockname()[0]))
    with suppress(OSError):
        for entry in socket.getaddrinfo(socket.gethostname(), None, type=socket.SOCK_STREAM):
            found.append(str(entry[4][0]))
    kept = [address.partition("%")[0] for address in found]
    return tuple(dict.fromkeys([*kept, "127.0.0.1"]))


def host_names() -> tuple[str, ...]:
    """Return the names by which a network may know this machine."""
    name = socket.gethostname().lower().partition(".")[0]
    return (name, f"{name}.local") if name else ()


def _new_root(now: datetime) -> _Pair:
    key = ec.generate_private_key(ec.SECP256R1())
    name = _name(f"GaussianNexus Studio on {socket.gethostname()}"[:64])
    permitted = [x509.DNSName(domain) for domain in (*LOCAL_DOMAINS, *host_names()[:1])]
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - CLOCK_SLACK)
        .not_valid_after(now + ROOT_LIFE)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(is_root=True), critical=True)
        .add_extension(x509.NameConstraints(permitted, None), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    return _Pair(key, certificate)


def _new_leaf(root: _Pair, names: Sequence[str], *, now: datetime) -> _Pair:
    key = ec.generate_private_key(ec.SECP256R1())
    server = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH])
    certificate = (
        _signed_by(root, key, common_name="GaussianNexus Studio", lasts=LEAF_LIFE, now=now)
        .add_extension(server, critical=False)
        .add_extension(x509.SubjectAlternativeName(_alternatives(names)), critical=False)
        .sign(root.key, hashes.SHA256())
    )
    return _Pair(key, certificate)


def _signed_by(
    root: _Pair,
    key: ec.EllipticCurvePrivateKey,
    *,
    common_name: str,
    lasts: timedelta,
    now: datetime,
) -> x509.CertificateBuilder:
    """Return a certificate of a root, still to be signed."""
    authority = x509.AuthorityKeyIdentifier.from_issuer_public_key(root.key.public_key())
    return (
        x509.CertificateBuilder()
        .subject_name(_name(common_name))
        .issuer_name(root.certificate.subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - CLOCK_SLACK)
        .not_valid_after(now + lasts)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(is_root=False), critical=True)
        .add_extension(authority, critical=False)
    )


def _usage(*, is_root: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not is_root,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=is_root,
        crl_sign=is_root,
        encipher_only=False,
        decipher_only=False,
    )


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _alternatives(names: Sequence[str]) -> list[x509.GeneralName]:
    """Return names and addresses as a certificate lists them, without those that are neither."""
    found: dict[str, x509.GeneralName] = {}
    for name in ("localhost", "127.0.0.1", "::1", *names):
        try:
            address = ipaddress.ip_address(name)
        except ValueError:
            with suppress(ValueError):
                found[name.lower()] = x509.DNSName(name.lower())
        else:
            if not address.is_unspecified:
                found[str(address)] = x509.IPAddress(address)
    return list(found.values())


def _is_good(leaf: _Pair, root: _Pair, *, names: Sequence[str], now: datetime) -> bool:
    """Whether a leaf is of this root, for all the names, and has time left."""
    certificate = leaf.certificate
    if not certificate.not_valid_before_utc <= now < certificate.not_valid_after_utc - RENEW_BEFORE:
        return False
    try:
        certificate.verify_directly_issued_by(root.certificate)
        listed = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except Exception:  # noqa: BLE001 - whatever is wrong with it, a new one is made
        return False
    return set(_alternatives(names)) <= set(listed)


def _write(path: Path, pair: _Pair) -> None:
    write_whole(path, _pem(pair), is_private=True)


def _pem(pair: _Pair) -> list[bytes]:
    """Return key and certificate as they are kept."""
    key = pair.key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    return [key, pair.certificate.public_bytes(serialization.Encoding.PEM)]


def _read(path: Path) -> _Pair | None:
    """Return key and certificate of a file; None where there is none that can be read."""
    if not path.is_file() or path.stat().st_size > MAX_PEM_BYTES:
        return None
    if path.stat().st_mode & 0o077 and os.name == "posix":
        path.chmod(0o600)
    data = path.read_bytes()
    try:
        key = serialization.load_pem_private_key(data, None)
        certificate = x509.load_pem_x509_certificate(data)
    except (ValueError, TypeError):
        return None
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        return None
    return _Pair(key, certificate) if key.public_key() == certificate.public_key() else None
