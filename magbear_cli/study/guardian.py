"""A small process that kills a worker when the parent is gone, where the kernel has no such service.

Started by the worker as a script with the worker's end of the socket and its process id. It only waits for the parent's
end to close; a thread in the worker could not, because a hung kernel stops every thread.
"""

import os
import select
import signal
import sys


def kill_when_closed(descriptor: int, worker: int) -> None:
    """Wait until the other end of the socket closes, then kill the worker if it is still this process's parent."""
    watch = select.poll()
    watch.register(descriptor, 0)
    while not any(events & (select.POLLHUP | select.POLLERR) for _, events in watch.poll()):
        pass
    if os.getppid() == worker:
        os.kill(worker, signal.SIGKILL)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    kill_when_closed(int(sys.argv[1]), int(sys.argv[2]))
