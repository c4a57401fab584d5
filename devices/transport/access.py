"""The router's configuration: mutual TLS, limits, rules by role; the rest is denied."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from devices.hub.entry.certificates import LEAF_FILE
from devices.transport.keys import ANY, PREFIX, MemberRole
from devices.transport.passes import ROOT_PUBLIC_FILE, Admitted
from devices.transport.source import BEAT
from devices.transport.transport import MAX_ANSWER_BYTES

LEASE_MS = 1500
"""Silence after which a link is dead, milliseconds: a split is noticed before a member is away."""

LINK: Mapping[str, Any] = {
    "unicast": {"open_timeout": 800, "accept_timeout": 800},
    "link": {
        "tx": {"lease": LEASE_MS, "keep_alive": 4},
        "rx": {"max_message_size": 2 * MAX_ANSWER_BYTES},
    },
}
"""Of every link: how soon one is given up, and how much is read of one message."""

MAX_LINKS = 4096
"""Machines that one router takes."""

FOLDER = "/etc/gaussiannexus"
"""Folder of the router's files in the configuration that the documentation shows."""

EXAMPLE = (
    Admitted(MemberRole.ROOM, "hall-3"),
    Admitted(MemberRole.SITE, "north"),
    Admitted(MemberRole.SITE, "south"),
    Admitted(MemberRole.WATCHER, "lobby"),
)
"""Members in the configuration that the documentation shows."""

COMMENT = f"""Router of a building: `zenohd -c THIS FILE` or `nexus sites router`.
Who has no certificate of {FOLDER}/{ROOT_PUBLIC_FILE} is refused; what no rule allows is denied.
`nexus sites router` writes this file anew with the members of {FOLDER}/members.txt."""
"""First lines of a router's file."""

_SPEAKS = ("put", "declare_queryable", "reply")
"""Messages of whoever publishes."""

_HEARS = ("declare_subscriber", "query")
"""Messages of whoever follows."""


def router_fields(
    folder: Path | str, *, listen: str, members: Sequence[Admitted] | None
) -> dict[str, Any]:
    """Return a router's configuration, in zenoh's words.

    Args:
        folder: of the building's certificates.
        listen: host and port.
        members: who has a pass; None for a router without TLS and rules, on this computer alone.
    """
    fields: dict[str, Any] = {
        "mode": "router",
        "listen": {"endpoints": [f"{'tcp' if members is None else 'tls'}/{listen}"]},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {
            "unicast": {**LINK["unicast"], "max_sessions": MAX_LINKS},
            "link": dict(LINK["link"]),
        },
    }
    if members is None:
        return fields
    fields["transport"]["link"]["tls"] = {
        "root_ca_certificate": f"{folder}/{ROOT_PUBLIC_FILE}",
        "listen_private_key": f"{folder}/{LEAF_FILE}",
        "listen_certificate": f"{folder}/{LEAF_FILE}",
        "enable_mtls": True,
        "close_link_on_expiration": True,
    }
    fields["access_control"] = access_rules(members)
    return fields


def access_rules(members: Sequence[Admitted]) -> dict[str, Any]:
    """Return who may do what, by the name in the certificate; the rest is denied.

    A room speaks in its own session as itself, and hears the sites there. A site hears any room,
    and speaks in any session as itself. A watcher hears that rooms are live.
    """
    rules: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    for member in members:
        name = member.common_name
        own, others = _keys(member)
        made: list[dict[str, Any]] = []
        if own:
            made += [
                _rule(f"{name} speaks", "ingress", messages=_SPEAKS, key=own),
                _rule(f"{name} is asked", "egress", messages=_HEARS, key=own),
            ]
        made += [
            _rule(f"{name} hears", "ingress", messages=_HEARS, key=others),
            _rule(f"{name} is told", "egress", messages=_SPEAKS, key=others),
        ]
        rules += made
        policies.append({"rules": [rule["id"] for rule in made], "subjects": [name]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [
            {"id": member.common_name, "cert_common_names": [member.common_name]}
            for member in members
        ],
        "policies": policies,
    }


def to_json5(fields: Mapping[str, Any], *, comment: str) -> str:
    """Return a configuration as a file that `zenohd -c FILE` reads."""
    lines = "".join(f"// {line}\n" for line in comment.splitlines())
    return f"{lines}{json.dumps(dict(fields), indent=2)}\n"


def _keys(member: Admitted) -> tuple[str, str]:
    """Return the keys at which a member speaks, and those that it hears."""
    rooms = f"{PREFIX}/{ANY}/{MemberRole.ROOM}/{ANY}"
    if member.role is MemberRole.ROOM:
        session = f"{PREFIX}/{member.name}"
        own = f"{session}/{MemberRole.ROOM}/{member.name}/**"
        return own, f"{session}/{MemberRole.SITE}/**"
    if member.role is MemberRole.SITE:
        return f"{PREFIX}/{ANY}/{MemberRole.SITE}/{member.name}/**", f"{rooms}/**"
    return "", f"{rooms}/{BEAT}"


def _rule(rule_id: str, flow: str, *, messages: Sequence[str], key: str) -> dict[str, Any]:
    return {
        "id": rule_id,
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": [key],
    }
