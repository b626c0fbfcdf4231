"""The weights of policies, checked as in ``certificate`` for reading A, in one pass."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def of_rows(start, own, tester, ego, kept, total, room):  # type: ignore[no-untyped-def]
    """Whether the tester plays whole rows, which are kept, and the ego answers each kept row.

    Args:
        start: where the cells of each row begin.
        own: the state of each row.
        total: what the tester's weights sum to in each state, 0 so far; filled in here.
        room: by which the ego's weights in a row may miss 1.
    """
    for r in range(len(own)):
        chosen, answered = tester[start[r]], 0.0
        if chosen not in (0.0, 1.0):
            return False
        for c in range(start[r], start[r + 1]):
            if tester[c] != chosen or ego[c] < 0.0 or (chosen > 0.0 and not kept[c]):
                return False
            answered += ego[c]
        if kept[start[r]] and not abs(answered - 1.0) <= room:
            return False
        total[own[r]] += chosen
    return True
