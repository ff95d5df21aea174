"""A Dask cluster that is already there, as an executor."""

import logging
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

import symmotion as sm

PATIENCE = 10  # seconds for the scheduler to answer


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """The workers of the Dask scheduler at an address such as tcp://10.0.0.1:8786, as an executor.

    Raises InputError where Dask is not installed, nothing answers at the address, or no worker is there.
    """
    try:
        from distributed import Client  # pyright: ignore[reportMissingImports] an extra
        from distributed.comm.addressing import get_address_host_port  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise sm.InputError("--scheduler needs Dask: pip install 'symmotion[distributed]'") from error
    try:
        get_address_host_port(address, strict=True)
    except ValueError as error:
        raise sm.InputError(f"--scheduler {address!r}: an address such as tcp://10.0.0.1:8786 is needed") from error
    # What it logs while it tries is said below, in one line.
    logger = logging.getLogger("distributed")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except OSError as error:
        raise sm.InputError(f"--scheduler {address}: no Dask scheduler answers there") from error
    finally:
        logger.setLevel(level)
    with client:
        if not client.scheduler_info(n_workers=-1)["workers"]:
            raise sm.InputError(f"--scheduler {address}: it has no workers yet; --help says how to start them")
        executor = client.get_executor()
        try:
            yield executor
        finally:
            executor.shutdown(wait=False)  # cancels what an interrupt has left there
