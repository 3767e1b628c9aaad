import json
import os
import select
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from rigs.clock.busy_machine import PATIENCE

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="there are no pidfds here"),
]

SERVER = """
import asyncio, json, os, sys, threading

os.environ["OPENBLAS_NUM_THREADS"] = "1"
from openpendant.server.planning.jobs import JointPathJob, PlanTask
from openpendant.server.planning.pool.forked_child import forked_children
from openpendant.server.planning.pool.planning_pool import PlanningPool

told = {}

def forked():
    with forked_children(["ur5"], 1) as children:
        return len(children)

async def forked_on_a_loop():
    return forked()

def is_childless():
    try:
        os.waitpid(-1, os.WNOHANG)
    except ChildProcessError:
        return True
    return False

async def planned(children):
    pool = PlanningPool(["ur5"] * 2, children)
    keeper = asyncio.create_task(pool.keep_up())
    answers = asyncio.Queue()
    for number in range(2):
        job = JointPathJob(number, (0.0,) * 6, ((0.1,) * 6,), 0.5)
        pool.submit(PlanTask("ur5", job, answers.put_nowait, cell=number))
    results = [(await answers.get()).result for _ in range(2)]
    told["answered"] = [isinstance(result, tuple) for result in results]
    if "end" in sys.argv:
        keeper.cancel()
        await asyncio.gather(keeper, return_exceptions=True)
        told["codes"] = [child.returncode for child in children]
        return
    print(json.dumps(told), flush=True)
    await asyncio.sleep(60)

told["alone"] = forked()
told["is_childless"] = is_childless()
told["on_a_loop"] = asyncio.run(forked_on_a_loop())
with forked_children(["ur5"], 2) as children:
    told["pids"] = [child.pid for child in children]
    ended = threading.Event()
    threading.Thread(target=ended.wait).start()
    told["beside_a_thread"] = forked()
    ended.set()
    asyncio.run(planned(children))
told["is_childless_again"] = is_childless()
print(json.dumps(told), flush=True)
"""


@contextmanager
def serving(*arguments: str) -> Iterator[tuple[subprocess.Popen[bytes], dict[str, Any]]]:
    command = [sys.executable, "-c", SERVER, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line, "it ended before it told what it did"
        try:
            yield process, json.loads(line)
        finally:
            process.kill()


def test_processes_are_forked_only_where_nothing_else_runs_and_are_gone_with_their_context() -> (
    None
):
    with serving("end") as (process, told):
        assert process.wait(PATIENCE) == 0
    assert (told["alone"], told["on_a_loop"], told["beside_a_thread"]) == (1, 0, 0)
    assert told["is_childless"]
    assert told["answered"] == [True, True]
    assert told["codes"] == [0, 0]
    assert told["is_childless_again"]


def test_forked_processes_end_with_a_server_that_is_killed() -> None:
    with serving() as (process, told):
        ends = [os.pidfd_open(pid) for pid in told["pids"]]
        assert len(ends) == 2
        process.kill()
        process.wait(PATIENCE)
        for end in ends:
            assert select.select([end], [], [], PATIENCE)[0] == [end]
            os.close(end)
