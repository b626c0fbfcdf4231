"""Episodes in a separate process, the called side: it plays them for an environment."""

from __future__ import annotations

import contextlib
import signal
import sys
import tempfile
from multiprocessing.connection import Connection
from typing import Any

from cavsumo.batch.worker_process import divert_output
from cavsumo.errors import CavsumoError, SimulationError
from cavsumo.model.processes import end_with_parent


def main(pipe_fd: int, parent: int) -> None:
    """Serve calls until the pipe closes."""
    end_with_parent(parent)()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    pipe = Connection(pipe_fd)
    with tempfile.TemporaryFile() as log:  # SUMO's output
        divert_output(log.fileno())
        with contextlib.suppress(EOFError, ConnectionError):
            _serve(pipe)


def _serve(pipe: Connection) -> None:
    """Answer each call with its result or its error."""
    from cavsumo.envs.episodes import Episodes

    episodes = Episodes(*pipe.recv())
    with contextlib.closing(episodes):
        while True:
            method, arguments = pipe.recv()
            pipe.send(_answer(getattr(episodes, method), arguments))


def _answer(method: Any, arguments: tuple[Any, ...]) -> Any:
    try:
        return method(*arguments)
    except CavsumoError as error:
        return SimulationError(str(error)) if type(error).__init__ is not _PLAIN else error
    except Exception as error:  # so that the process lives on and the caller learns of it
        return SimulationError(f"defect: {error!r}")


_PLAIN = CavsumoError.__init__  # an error with another one may not survive the way through a pipe

if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
