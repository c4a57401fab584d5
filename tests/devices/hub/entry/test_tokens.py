"""Tokens: the hub's own of this session, for their time, and no others."""

import json
from base64 import urlsafe_b64decode, urlsafe_b64encode
from random import Random

import jwt
import pytest

from devices.hub.entry.tokens import ALGORITHM, TOKEN_NS, Ticket, TokenRefused, Tokens
from devices.hub.roles import Role

TICKET = Ticket("p1", Role.REMOTE, 3)


@pytest.fixture
def tokens():
    return Tokens(Random(0).randbytes)


def why(tokens, token, now_ns=0):
    with pytest.raises(TokenRefused) as caught:
        tokens.read(token, now_ns)
    assert not token or token not in str(caught.value)
    assert caught.value.__cause__ is None
    return str(caught.value)


def test_a_token_comes_back(tokens):
    assert tokens.read(tokens.make(TICKET, 7), 7) == TICKET


def test_a_token_expires(tokens):
    token = tokens.make(TICKET, 0)
    assert tokens.read(token, TOKEN_NS - 1) == TICKET
    assert "expired" in why(tokens, token, TOKEN_NS)
    assert "expired" in why(tokens, tokens.make(TICKET, 0, life_ns=5), 5)


def test_another_session_refuses_it(tokens):
    assert "not of this session" in why(Tokens(Random(1).randbytes), tokens.make(TICKET, 0))


def test_a_changed_token_is_refused(tokens):
    token = tokens.make(TICKET, 0)
    head, body, signature = token.split(".")
    claims = json.loads(urlsafe_b64decode(body + "=="))
    claims["role"] = "operator"
    forged = urlsafe_b64encode(json.dumps(claims).encode()).decode().rstrip("=")
    why(tokens, ".".join((head, forged, signature)))
    for at in range(0, len(token), 7):
        other = "A" if token[at] != "A" else "B"
        why(tokens, token[:at] + other + token[at + 1 :])
        why(tokens, token[:at])


def test_a_token_without_a_signature_is_refused(tokens):
    claims = {"session": "x", "person": "p1", "role": "operator", "number": 1, "until_ns": 9}
    why(tokens, jwt.encode(claims, "", algorithm="none"))
    why(tokens, jwt.encode(claims, "k" * 32, algorithm="HS256"))
    why(tokens, jwt.encode(claims, "k" * 64, algorithm="HS512"))


def test_a_token_of_other_fields_is_refused(tokens):
    odd = jwt.encode({"session": "x"}, tokens._key, algorithm=ALGORITHM)
    assert "another session" in why(tokens, odd)


@pytest.mark.parametrize("token", ["", "a.b.c", ".", "\ud800", "a" * 2000, "é.é.é"])
def test_what_is_no_token_is_refused(tokens, token):
    why(tokens, token)
