from __future__ import annotations

import asyncio
from functools import partial

import pytest

from openpendant.server.access.access_backend import PasswordWorker
from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.passwords import PasswordHash, ScryptCost, Secret, hash_password

CHEAP = ScryptCost(n=2**14, r=8, p=1)


@pytest.fixture(scope="module")
def kept() -> PasswordHash:
    return hash_password(Secret("correct horse"), bytes(16), CHEAP)


def job(number: int, kept: PasswordHash, password: str = "correct horse") -> VerifyJob:
    return VerifyJob(number, 1, Secret(password), kept)


@pytest.mark.asyncio
@pytest.mark.virtual_clock
async def test_an_answer_comes_later_with_its_job(kept: PasswordHash) -> None:
    worker = PasswordWorker()
    answers: list[tuple[int, bool | None]] = []

    def answered(number: int, right: bool | None) -> None:
        answers.append((number, right))

    for number, password in ((1, "correct horse"), (2, "wrong")):
        worker.submit(job(number, kept, password), partial(answered, number))
    assert answers == []
    await asyncio.sleep(0.01)
    assert answers == [(1, True), (2, False)]
    worker.close()


@pytest.mark.asyncio
@pytest.mark.realtime
async def test_the_loop_goes_on_while_passwords_are_checked(kept: PasswordHash) -> None:
    worker = PasswordWorker(most_waiting=4)
    answers: list[bool | None] = []
    turns: list[int] = []
    while len(turns) < 5 and not any(count > 20 for count in turns):  # a busy machine has few
        answers.clear()
        for number in range(6):
            worker.submit(job(number, kept), answers.append)
        turns.append(0)
        async with asyncio.timeout(60):
            while len(answers) < 6:
                await asyncio.sleep(0.001)
                turns[-1] += 1
        assert answers == [None, None, True, True, True, True]
    assert turns[-1] > 20, turns
    worker.close()
