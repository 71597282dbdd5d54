"""Workers of a Dask cluster as an executor, for work that exceeds one machine.

The library takes any `concurrent.futures.Executor` as `executor=`; this one is `distributed.Client.get_executor()`. The workers need
this package, and must see the folders that a scene reads and writes under the same paths.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

INSTALL = 'python -m pip install "molrotor[dask]"'
WAIT_SECONDS = 10  # for a scheduler to answer


@contextmanager
def dask_executor(address: str, security: Any = None) -> Iterator[Executor]:
    """The workers of a Dask scheduler, until the end of the context; after an error, pieces not yet begun are cancelled.

    address: tcp://head:8786, or tls://head:8786. security: a `distributed.Security` with the certificates of an encrypted cluster
    (`tls_security`); by default Dask's configuration. Raises ValueError if dask.distributed is not installed, with the command that
    installs it, or if no scheduler answers.
    """
    client = _connected(_distributed().Client, address, security)
    pool = client.get_executor()
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False)  # cancels what has not begun
        raise
    else:
        pool.shutdown()
    finally:
        client.close()


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise ValueError(f"dask.distributed is not installed; {INSTALL} installs it") from None
    return distributed


def _connected(client: Any, address: str, security: Any) -> Any:
    """A client of the scheduler at an address."""
    try:
        return client(address, timeout=WAIT_SECONDS, set_as_default=False, security=security)
    except (OSError, TimeoutError, ValueError, TypeError) as error:
        reason = str(error)
    # Dask does not close a client whose start failed. Collected later, in the thread of the next client, it waits for a lock that
    # the start of that next client holds (distributed.utils.LoopRunner): collected here, it ends at once.
    gc.collect()
    raise ValueError(
        f"{address}: no scheduler of Dask answers within {WAIT_SECONDS} s ({reason}); expected an address such as tcp://head:8786, "
        "or tls://head:8786 with certificates"
    )


def tls_security(authority: str, certificate: str, key: str) -> Any:
    """Security of a client in an encrypted cluster, from PEM files of the authority, the client's certificate and its key.

    Raises ValueError for a missing file, and if dask.distributed is not installed.
    """
    for name in (authority, certificate, key):
        if not Path(name).is_file():
            raise ValueError(
                f"{name}: no such file; expected PEM files of the authority, the client's certificate, its key"
            )
    return _distributed().Security(
        tls_ca_file=authority, tls_client_cert=certificate, tls_client_key=key, require_encryption=True
    )
