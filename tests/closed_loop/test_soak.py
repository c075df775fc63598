"""Long operation and many starts leak no memory, thread, descriptor or child.

The quick forms run always; an hour of operation and a thousand starts with `-m slow`.
"""

from __future__ import annotations

import sys
from statistics import median

import pytest
from lsds_research.collecting.objects import PLANS

from tests.closed_loop.soak import ROUND_S, change_objects, children, operate, start_and_stop

pytestmark = [
    pytest.mark.usefixtures("installed_host"),
    pytest.mark.skipif(sys.platform != "linux", reason="reads /proc"),
]
#: Blocks of memory that a round, or a start, may leave: counters that have grown, not an object per frame or task.
BLOCKS_A_ROUND, BLOCKS_A_START = 300, 100


def test_operation_grows_by_nothing():
    before = children()
    seen = operate(3)
    assert [look.ended for look in seen] == [1, 2, 3]
    # The first rounds fill buffers of a fixed length. A leak of a frame's results would be thousands of blocks a round.
    assert seen[-1].blocks - seen[0].blocks < 2 * BLOCKS_A_ROUND + 1500
    assert {(look.threads, look.descriptors) for look in seen} == {(seen[0].threads, seen[0].descriptors)}
    assert children() == before


def test_starting_and_stopping_leaves_nothing():
    before = children()
    seen = start_and_stop(8)
    assert seen[-1].blocks - seen[3].blocks < 4 * BLOCKS_A_START
    assert {(look.threads, look.descriptors) for look in seen[2:]} == {(seen[2].threads, seen[2].descriptors)}
    assert children() == before


@pytest.mark.slow
def test_an_hour_of_operation():
    seen = operate(round(3600 / ROUND_S))
    minute = next(look for look in seen if look.ended * ROUND_S >= 60)
    assert seen[-1].resident_kb - minute.resident_kb < 1000
    assert (seen[-1].threads, seen[-1].descriptors) == (minute.threads, minute.descriptors)


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_an_hour_of_changing_objects():
    """The first two rounds, six minutes, fill the bounded caches of gel matrices and surfaces."""
    seen = change_objects(list(PLANS), 3600)
    early, late = seen[2:5], seen[-3:]
    print(*seen, sep="\n")
    assert median(visit.look.resident_kb for visit in late) - median(visit.look.resident_kb for visit in early) < 20_000
    assert max(visit.look.blocks for visit in late) - min(visit.look.blocks for visit in early) < 2 * BLOCKS_A_ROUND
    assert {(visit.look.threads, visit.look.descriptors) for visit in seen[1:]} == {
        (seen[1].look.threads, seen[1].look.descriptors)
    }


@pytest.mark.slow
def test_a_thousand_starts():
    seen = start_and_stop(1000)
    assert seen[-1].blocks - seen[100].blocks < 900 * BLOCKS_A_START
    assert (seen[-1].threads, seen[-1].descriptors) == (seen[100].threads, seen[100].descriptors)
