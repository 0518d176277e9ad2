"""Signals that ask to stop, in a process that has handlers for them."""

import signal
import threading
from typing import Never

import pytest

from spin_usd.basics.stop_signals import STOP_SIGNALS, WAY_OUT_S, Stopped, let_signals_stop, postponed

pytestmark = pytest.mark.children


@pytest.fixture(autouse=True)
def handlers():
    """Those of the tests come back."""
    before = {number: signal.getsignal(number) for number in STOP_SIGNALS}
    let_signals_stop()
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_a_signal_stops_and_later_ones_do_not_interrupt_the_way_out(number) -> None:
    with pytest.raises(Stopped) as stopped:
        signal.raise_signal(number)
    assert stopped.value.number == number
    for other in STOP_SIGNALS:
        signal.raise_signal(other)


def test_a_signal_counts_again_when_the_first_was_swallowed() -> None:
    """As code does that C calls, which prints an exception and goes on."""
    seconds = iter([0.0, 0.0, WAY_OUT_S - 0.1, WAY_OUT_S, WAY_OUT_S])
    let_signals_stop(lambda: next(seconds))
    with pytest.raises(Stopped):
        signal.raise_signal(signal.SIGINT)
    signal.raise_signal(signal.SIGINT)
    with pytest.raises(Stopped):
        signal.raise_signal(signal.SIGINT)


def sent_while_postponed(*numbers, then=lambda: None):
    """Send the signals in a block that postpones; return those that did not stop it, and the signal that did in the
    end."""
    heard = []
    try:
        with postponed():
            for number in numbers:
                signal.raise_signal(number)
                heard.append(number)
            then()
    except Stopped as stopped:
        return heard, stopped.number
    return heard, None


@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_a_postponed_one_waits_for_the_end_of_the_block(number) -> None:
    assert sent_while_postponed(number) == ([number], number)


@pytest.mark.parametrize("second", [signal.SIGINT, signal.SIGTERM])
def test_the_second_stops_at_once(second) -> None:
    assert sent_while_postponed(signal.SIGTERM, second) == ([signal.SIGTERM], second)


def test_a_closed_terminal_that_says_so_twice_is_one_signal() -> None:
    twice = [signal.SIGHUP, signal.SIGHUP]
    assert sent_while_postponed(*twice) == (twice, signal.SIGHUP)


def test_the_block_can_see_that_a_signal_came() -> None:
    with postponed() as outer, postponed() as inner:
        signal.raise_signal(signal.SIGINT)
        assert (inner.number, outer.number) == (signal.SIGINT, None)
        inner.number = None


def test_an_error_in_the_block_is_told_instead() -> None:
    def fail() -> Never:
        raise ValueError("full")

    with pytest.raises(ValueError, match="full"):
        sent_while_postponed(signal.SIGINT, then=fail)
    assert sent_while_postponed() == ([], None)


def test_what_is_ignored_stays_ignored() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    let_signals_stop()
    with postponed() as request:
        signal.raise_signal(signal.SIGHUP)
    assert request.number is None


def test_other_threads_are_left_alone() -> None:
    found = []

    def work() -> None:
        with postponed() as request:
            found.append(request.number)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [None]
