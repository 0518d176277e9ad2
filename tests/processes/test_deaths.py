"""How often work is tried again whose child died."""

import pytest

from spin_usd.processes.deaths import TRIES, ChildDiedError, DeathCause, Retries


def death(cause):
    return ChildDiedError(f"it {cause}", cause=cause)


@pytest.mark.parametrize("cause", DeathCause)
def test_the_same_cause_again_and_again_is_no_accident(cause) -> None:
    retries = Retries()
    tries = 1
    while retries.may_try_again(death(cause)):
        tries += 1
    assert tries == TRIES[cause] > 1
    assert retries.in_words(death(cause)) == f"it {cause}, {'twice' if tries == 2 else f'{tries} times'}"


def test_other_causes_do_not_count() -> None:
    retries = Retries()
    assert all(retries.may_try_again(death(cause)) for cause in DeathCause)
    assert retries.in_words(death(DeathCause.GREW)) == "it grew"


def test_what_comes_from_outside_is_forgiven_most() -> None:
    outside = {DeathCause.KILLED, DeathCause.LOST}
    assert min(TRIES[cause] for cause in outside) > max(TRIES[cause] for cause in set(DeathCause) - outside)
