"""The hub's own root and leaf: browsers that trust the root trust this machine, and no other."""

import ssl
from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509

from devices.hub.entry.certificates import (
    LEAF_FILE,
    LEAF_LIFE,
    RENEW_BEFORE,
    ROOT_FILE,
    ROOT_LIFE,
    CertificateError,
    host_names,
    keep_certificates,
    lan_addresses,
)

NOW = datetime(2026, 11, 27, tzinfo=UTC)
NAMES = ("192.168.1.7", "fd00::7", "studio.local")


def serial(path):
    return x509.load_pem_x509_certificate(path.read_bytes()).serial_number


def serials(folder):
    return serial(folder / ROOT_FILE), serial(folder / LEAF_FILE)


def shake_hands(made, host):
    """A TLS handshake in memory of whoever trusts the root."""
    server = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    server.load_cert_chain(made.leaf_file)
    client = ssl.create_default_context(cadata=made.root_pem.decode())
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    a = client.wrap_bio(to_client, to_server, server_hostname=host)
    b = server.wrap_bio(to_server, to_client, server_side=True)
    waiting = [a, b]
    for _round in range(10):
        for side in list(waiting):
            try:
                side.do_handshake()
                waiting.remove(side)
            except ssl.SSLWantReadError:
                continue
    assert not waiting


def test_who_trusts_the_root_trusts_the_machine(tmp_path):
    made = keep_certificates(tmp_path / "c", names=NAMES)
    for host in ("192.168.1.7", "fd00::7", "studio.local", "localhost", "127.0.0.1"):
        shake_hands(made, host)
    with pytest.raises(ssl.SSLCertVerificationError):
        shake_hands(made, "192.168.1.8")


def test_the_root_is_good_for_no_site_of_the_internet(tmp_path):
    made = keep_certificates(tmp_path, names=("bank.example",))
    with pytest.raises(ssl.SSLCertVerificationError, match="permitted subtree"):
        shake_hands(made, "bank.example")


def test_keys_are_for_the_user_alone(tmp_path):
    folder = tmp_path / "c"
    keep_certificates(folder, names=NAMES)
    assert sorted(file.name for file in folder.iterdir()) == [LEAF_FILE, ROOT_FILE]
    for file in folder.iterdir():
        assert file.stat().st_mode & 0o777 == 0o600
    assert folder.stat().st_mode & 0o777 == 0o700
    (folder / LEAF_FILE).chmod(0o644)
    keep_certificates(folder, names=NAMES)
    assert (folder / LEAF_FILE).stat().st_mode & 0o777 == 0o600


def test_the_root_that_is_given_out_holds_no_key(tmp_path):
    root = keep_certificates(tmp_path, names=NAMES).root_pem
    assert root.count(b"BEGIN") == 1
    assert b"PRIVATE" not in root


def test_what_is_good_stays(tmp_path):
    keep_certificates(tmp_path, names=NAMES, now=NOW)
    before = serials(tmp_path)
    keep_certificates(tmp_path, names=NAMES[:2], now=NOW + timedelta(days=10))
    assert serials(tmp_path) == before


@pytest.mark.parametrize(
    ("later", "names", "is_root_new"),
    [
        (LEAF_LIFE - RENEW_BEFORE, NAMES, False),
        (timedelta(0), (*NAMES, "10.1.2.3"), False),
        (ROOT_LIFE - LEAF_LIFE + timedelta(days=1), NAMES, True),
        (-timedelta(days=30), NAMES, False),
    ],
    ids=["near its end", "another address", "the root near its end", "not yet good"],
)
def test_a_leaf_is_made_anew(tmp_path, later, names, is_root_new):
    keep_certificates(tmp_path, names=NAMES, now=NOW)
    root, leaf = serials(tmp_path)
    keep_certificates(tmp_path, names=names, now=NOW + later)
    new_root, new_leaf = serials(tmp_path)
    assert new_leaf != leaf
    assert (new_root != root) == is_root_new


@pytest.mark.parametrize("damage", [b"", b"junk", bytes(70_000)])
@pytest.mark.parametrize("file", [ROOT_FILE, LEAF_FILE])
def test_a_damaged_file_is_made_anew(tmp_path, file, damage):
    keep_certificates(tmp_path, names=NAMES)
    (tmp_path / file).write_bytes(damage)
    shake_hands(keep_certificates(tmp_path, names=NAMES), "192.168.1.7")


def test_key_and_certificate_of_different_moments_are_made_anew(tmp_path):
    keep_certificates(tmp_path / "a", names=NAMES)
    keep_certificates(tmp_path / "b", names=NAMES)
    mixed = tmp_path / "a" / LEAF_FILE
    key = mixed.read_text().partition("-----BEGIN CERT")[0]
    other = (tmp_path / "b" / LEAF_FILE).read_text().partition("-----BEGIN CERT")
    mixed.write_text(key + "".join(other[1:]))
    shake_hands(keep_certificates(tmp_path / "a", names=NAMES), "192.168.1.7")


def test_names_that_are_none_are_left_out(tmp_path):
    shake_hands(keep_certificates(tmp_path, names=("0.0.0.0", "ä ö", "10.0.0.1")), "10.0.0.1")


def test_a_file_in_the_way(tmp_path):
    (tmp_path / "c").write_text("")
    with pytest.raises(CertificateError, match="choose a folder"):
        keep_certificates(tmp_path / "c", names=NAMES)


def test_this_machine_has_addresses_and_a_name():
    assert "127.0.0.1" in lan_addresses()
    assert all(name == name.lower() for name in host_names())
