"""Messages of people's clients on the wire of a hub's port."""

import struct

from devices.hub.protocol.messages import Do, Hello, read_message
from sim.wire.people_messages import frame, greeting_of, valid_texts


def test_frames_are_those_of_a_client():
    assert frame(b"abc", opcode=1) == b"\x81\x83\x11\x22\x33\x44" + bytes(
        a ^ b for a, b in zip(b"abc", b"\x11\x22\x33", strict=True)
    )
    assert frame(bytes(300), opcode=2)[:4] == b"\x82\xfe" + struct.pack(">H", 300)


def test_a_client_greets_with_an_upgrade_and_its_token():
    greeting = greeting_of(("127.0.0.1", 80), "secret")
    request, _, rest = greeting.partition(b"\r\n\r\n")
    assert request.startswith(b"GET /people HTTP/1.1\r\nHost: 127.0.0.1:80")
    assert rest[:2] == bytes([0x81, 0x80 | (len(rest) - 6)])


def test_what_clients_say_is_read_by_the_hub():
    read = [read_message(text.decode()) for text in valid_texts()]
    assert {Do, Hello} <= {type(each) for each in read}
