from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from lsds.contracts import Lifecycle
from lsds.contracts.lifecycle import LifecycleGuard
from lsds.errors import LifecycleError

N, C, A, X = Lifecycle.NEW, Lifecycle.CONNECTED, Lifecycle.ARMED, Lifecycle.CLOSED
ALLOWED = {
    "connecting": {N: C},
    "arming": {C: A},
    "disarming": {N: N, C: C, A: C, X: X},
    "closing": {N: X, C: X, A: X, X: X},
}
STEPS_UP = ("connecting", "arming")


@given(st.lists(st.tuples(st.sampled_from(sorted(ALLOWED)), st.booleans()), max_size=30))
def test_the_guard_follows_its_table(calls):
    guard, state = LifecycleGuard("x"), N
    for step, fails in calls:
        refused = False
        try:
            with getattr(guard, step)():
                if fails:
                    raise OSError
        except OSError:
            pass
        except LifecycleError:
            refused = True
        assert refused is (state not in ALLOWED[step])
        if not refused and not (fails and step in STEPS_UP):
            state = ALLOWED[step][state]
        assert guard.state is state
