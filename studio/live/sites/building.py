"""The folder of a building's router: root, certificates and passes."""

from __future__ import annotations

import os
from pathlib import Path

from devices.hub.entry.certificates import host_names, lan_addresses
from devices.hub.site import is_loopback
from devices.transport.access import COMMENT, router_fields, to_json5
from devices.transport.passes import keep_building, members
from scenes.formats.storage.atomic import write_whole
from studio.live.sites.reaching import RouterAddress

ROUTER_FILE = "router.json5"
"""Configuration of the router, as `zenohd -c` reads it."""

EVERYWHERE = "0.0.0.0"
"""Host that stands for all of this machine's addresses."""


def building_folder() -> Path:
    """Return the folder: in NEXUS_HOME where that is set, else in the user's data."""
    import platformdirs

    named = os.environ.get("NEXUS_HOME")
    home = Path(named) if named else Path(platformdirs.user_data_dir("gaussiannexus-studio"))
    return home / "building"


def prepare_building(folder: Path, listen: RouterAddress) -> None:
    """Make certificates of a building that are missing or too old.

    Raises:
        CertificateError: the folder cannot be written.
    """
    own = () if listen.host == EVERYWHERE else (listen.host,)
    keep_building(folder, names=tuple(dict.fromkeys((*lan_addresses(), *host_names(), *own))))


def router_configuration(
    folder: Path, listen: RouterAddress, *, is_plain: bool
) -> dict[str, object]:
    """Return a router's configuration, which is written into the building's folder as well.

    Args:
        folder: of the building.
        listen: where it listens.
        is_plain: without TLS and rules: for this computer alone.

    Raises:
        ValueError: it is open to the network without TLS.
        PassError: the list of members is damaged.
    """
    if is_plain:
        if not is_loopback(listen.host):
            raise ValueError(f"--plain: {listen.words} is not this computer alone; leave it out")
        return router_fields(folder, listen=listen.words, members=None)
    fields = router_fields(folder, listen=listen.words, members=members(folder))
    text = to_json5(fields, comment=COMMENT)
    write_whole(folder / ROUTER_FILE, [text.encode()], is_private=True)
    return fields
