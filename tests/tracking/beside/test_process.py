"""The search process answers orders one after the other, and leaves out what was given up."""

import os
import threading
from functools import partial

import numpy as np
import pytest

from tests.tracking.beside.orders import doubled, endless, fails, gives_a_lock
from tracking.beside.messages import decoded, encoded, read_message, write_message
from tracking.beside.process import serve


@pytest.fixture
def served():
    """Streams to write orders to and read answers from, of one that serves."""
    (their_orders, our_orders), (our_answers, their_answers) = os.pipe(), os.pipe()
    with (
        os.fdopen(our_orders, "wb") as orders,
        os.fdopen(our_answers, "rb") as answers,
        os.fdopen(their_orders, "rb") as in_stream,
        os.fdopen(their_answers, "wb") as out_stream,
    ):
        thread = threading.Thread(target=serve, args=(in_stream, out_stream), daemon=True)
        thread.start()
        yield orders, answers
        orders.close()
        thread.join(120)
        assert not thread.is_alive()


def answer_in(answers):
    message = read_message(answers)
    assert message is not None
    return message[0], decoded(message[1])


def test_orders_are_answered_in_turn(served):
    orders, answers = served
    for number in (1, 2, 3):
        write_message(orders, number, encoded(partial(doubled, np.arange(number))))
    for number in (1, 2, 3):
        got, answer = answer_in(answers)
        assert got == number
        assert not answer.failure
        np.testing.assert_array_equal(answer.result, 2 * np.arange(number))


def test_what_is_given_up_ends_at_its_next_step_and_has_no_answer(served):
    orders, answers = served
    write_message(orders, 1, encoded(endless))
    write_message(orders, 2, encoded(partial(doubled, np.ones(1))))
    write_message(orders, 1, ())
    assert answer_in(answers)[0] == 2


def test_what_an_order_raises_is_said(served):
    orders, answers = served
    write_message(orders, 1, encoded(fails))
    _, answer = answer_in(answers)
    assert "ValueError: no floor at 2.5 m" in answer.failure
    assert "orders.py" in answer.failure


def test_a_result_that_cannot_leave_the_process_is_said(served):
    orders, answers = served
    write_message(orders, 1, encoded(gives_a_lock))
    assert "cannot pickle" in answer_in(answers)[1].failure


def test_what_cannot_be_read_is_said_and_the_next_is_answered(served):
    orders, answers = served
    write_message(orders, 1, [b"no pickle"])
    assert "UnpicklingError" in answer_in(answers)[1].failure
    write_message(orders, 2, encoded(partial(doubled, np.ones(1))))
    assert answer_in(answers)[0] == 2


def test_an_endless_order_ends_with_the_orders(served):
    orders, _ = served
    write_message(orders, 1, encoded(endless))
