"""Workers of a Dask cluster as an executor: for what outgrows one machine.

Any `concurrent.futures.Executor` serves where the library takes `executor=`; this one is `distributed.Client.get_executor()`. The
workers need this package, and what a scene reads and writes must be the same folders for all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

INSTALL = 'python -m pip install "molrotor[dask]"'
WAIT_SECONDS = 10  # for a scheduler to answer


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """The workers of the scheduler at an address such as tcp://head:8786, until the end of the context.

    Raises ValueError where dask.distributed is not installed, with the command that installs it, and where no scheduler answers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise ValueError(f"dask.distributed is not installed; {INSTALL} installs it") from None
    try:
        client = Client(address, timeout=WAIT_SECONDS, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise ValueError(
            f"{address}: no scheduler of Dask answers within {WAIT_SECONDS} s ({error}); expected an address such as tcp://head:8786"
        ) from None
    try:
        with client.get_executor() as pool:
            yield pool
    finally:
        client.close()
