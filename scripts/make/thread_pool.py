"""Threads that Ctrl-C ends: what was not begun is not begun then."""
import concurrent.futures
import contextlib


@contextlib.contextmanager
def thread_pool(workers):
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        try:
            yield pool
        except BaseException:  # KeyboardInterrupt, too; the pool's own end would do all that was submitted
            pool.shutdown(wait=False, cancel_futures=True)
            raise
