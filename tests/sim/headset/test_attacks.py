import asyncio

from sim.headset.attacks import WRONG_CODES, _promoted, attack
from sim.headset.connection import HubAddress
from tests.sim.headset.conftest import PATIENCE_S


def test_a_hub_refuses_every_attack_and_goes_on(hub):
    attempts = asyncio.run(
        asyncio.wait_for(attack(HubAddress(hub.url), hub.hub, expired=hub.expired), PATIENCE_S)
    )
    assert [attempt.name for attempt in attempts if not attempt.was_refused] == []
    assert len(attempts) == 9 + 1 + WRONG_CODES + 1
    refused = hub.hub.counts().refused
    assert {"origin", "token", "op", "code", "guessing"} <= refused.keys()
    assert any("expired" in line for line in hub.said)


def test_another_role_is_written_into_a_token():
    import jwt

    token = jwt.encode({"role": "spectator", "person": "p1"}, b"k" * 32, algorithm="HS256")
    changed = jwt.decode(_promoted(token), options={"verify_signature": False})
    assert changed == {"role": "operator", "person": "p1"}
