"""Do work in a second process while the main process continues, such as drawing the pictures of a run.

The second process makes an object of one class, and calls its methods in the order in which they are requested. It ends
as soon as its standard input closes, so it never outlives the main process. It ignores Ctrl-C and SIGTERM, because the
main process decides how a run ends.

    python -m rpf3d_core.results.second_process rpf3d_core.results.plots.run Painter
"""

import os
import pickle
import queue
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any, BinaryIO

from rpf3d_core.jit.child_python import command_of, environment_of_child
from rpf3d_core.jit.garbage import collect_less_often

NUMBER = struct.Struct("<Q")
"""Binary form of a number in a message: the number of parts of the message, or the size (bytes) of a part."""
Message = Sequence[bytes | bytearray | memoryview]
"""A value as bytes: first its pickle, then the large arrays that the pickle refers to."""
READY = b"rpf3d: ready\n"
"""First bytes that the second process writes; if they differ, another program was started in place of Python."""
PATIENCE = 20.0
"""Longest time (s) that the main process waits for READY, which takes 0.05 s on an idle machine."""


COMPILES = "compiles"
"""Argument of a second process that may import numba."""


class SecondProcessEnded(Exception):
    """The second process ended before its work was done; the message states how it ended."""


class SecondProcess:
    """A second process that does the requested work in order, while the main process continues."""

    def __init__(self, process: "subprocess.Popen[bytes]") -> None:
        """Start the two threads that exchange messages with a process; process : from `_started`."""
        self._process = process
        self._open = 0
        self._began: bool | None = None
        self._requests: queue.SimpleQueue[Message | None] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[Any] = queue.SimpleQueue()
        threading.Thread(target=_send, args=(process.stdin, self._requests), daemon=True).start()
        threading.Thread(target=_listen, args=(process.stdout, self._answers), daemon=True).start()

    def has_begun(self) -> bool:
        """Wait until the process has started, at most PATIENCE seconds; return True if it has started in this time.

        The result is False if the process has ended, or if another program than this module was started.
        """
        if self._began is None:
            try:
                self._began = self._answers.get(timeout=PATIENCE) == BEGUN
            except queue.Empty:
                self._began = False
        return self._began

    def ask(self, method: str, *arguments: Any) -> None:
        """Request the call of a method, and return immediately. The arguments are values that can be pickled.

        Arrays are not copied, so they must not change until `wait` returns.
        """
        self._open += 1
        self._requests.put(_packed((method, arguments)))

    def wait(self) -> None:
        """Wait until all requests are done.

        Raises
        ------
        Exception
            The exception of the first method that failed in the second process.
        SecondProcessEnded
            The process did not start in time, or ended before it was done, for example because it was killed.
        """
        if not self.has_begun():
            raise SecondProcessEnded("did not start")
        while self._open:
            answer = self._answers.get()
            if isinstance(answer, Exception):
                raise answer
            if answer == ENDED:
                raise SecondProcessEnded(_how(self._process.wait()))
            self._open -= 1

    def end(self) -> None:
        """Stop the process, and the threads that exchange messages with it; work that is not done is lost."""
        self._process.kill()
        self._requests.put(None)
        self._process.wait()


BEGUN, ENDED = "begun", "ended"
"""Answers that mark the start and the end of the second process; the answer to a completed request is None."""


@contextmanager
def second_process(module: str, name: str, compiles: bool = False) -> Iterator[SecondProcess | None]:
    """Yield a second process that makes an object of a class and calls its methods; None if no process can start.

    The process starts immediately, because its imports take a second. The process ends with the `with` block.

    module, name : of the class, whose constructor takes no arguments
    compiles : True if the process may import numba, which takes a second
    """
    process = _started(module, name, *((COMPILES,) if compiles else ()))
    if process is None:
        yield None
        return
    second = SecondProcess(process)
    try:
        yield second
    finally:
        second.end()


def _started(module: str, name: str, *words: str) -> "subprocess.Popen[bytes] | None":
    """Start a process that runs this module, and return it; None if it cannot be started.

    The process has its own process group. Otherwise Ctrl-C at a terminal would end the process while it starts.

    module, name : of the class whose object the process makes; words : further arguments of `main`
    """
    own: dict[str, Any] = {"process_group": 0} if os.name == "posix" else {}
    if not sys.executable:  # Python is embedded in another program: no interpreter to start
        return None
    with suppress(OSError):
        return subprocess.Popen(
            command_of(__name__, module, name, *words), env=environment_of_child(), stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, **own,
        )  # fmt: skip
    return None


def _how(code: int) -> str:
    """Return in words how a process ended; code : exit code, negative for the number of a signal."""
    return f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"


def _send(pipe: BinaryIO, requests: "queue.SimpleQueue[Message | None]") -> None:
    """Write each request from a queue to the second process, until the request None.

    This function runs in a thread, so that a second process that does not read cannot delay the run.
    """
    with suppress(OSError), pipe:  # OSError: the process has ended
        while (request := requests.get()) is not None:
            _write(pipe, request)


def _listen(pipe: BinaryIO, answers: "queue.SimpleQueue[Any]") -> None:
    """Put the messages of the second process into a queue: BEGUN, the answers to requests, and ENDED at the end."""
    try:
        with suppress(OSError, EOFError), pipe:
            if pipe.read(len(READY)) == READY:
                answers.put(BEGUN)
                while True:
                    answers.put(_unpacked(_read(pipe)))
    finally:
        answers.put(ENDED)


def _packed(value: Any) -> Message:
    """Return a value as a message; large arrays are separate parts, so that they are not copied."""
    buffers: list[pickle.PickleBuffer] = []
    head = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    return [head, *(buffer.raw() for buffer in buffers)]


def _unpacked(message: Message) -> Any:
    return pickle.loads(message[0], buffers=message[1:])


def _write(pipe: BinaryIO, message: Message) -> None:
    pipe.write(NUMBER.pack(len(message)))
    for part in message:
        pipe.write(NUMBER.pack(len(part)))
        pipe.write(part)
    pipe.flush()


def _read(pipe: BinaryIO) -> Message:
    """Return the next message; raise EOFError at the end of the pipe."""
    return [_bytes(pipe, _number(pipe)) for _ in range(_number(pipe))]


def _number(pipe: BinaryIO) -> int:
    (number,) = NUMBER.unpack(_bytes(pipe, NUMBER.size))
    return int(number)


def _bytes(pipe: BinaryIO, size: int) -> bytearray:
    content = bytearray(size)
    if pipe.readinto(content) < size:  # type: ignore[attr-defined]
        raise EOFError
    return content


def main(module: str, name: str, *words: str) -> None:
    """Run the second process: make the object, and call the requested methods until one fails or standard input ends.

    module, name : of the object's class; words : COMPILES if the process may import numba
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    collect_less_often()
    if COMPILES not in words:
        sys.modules["numba"] = None  # type: ignore[assignment]  # prevents its import, which takes longer than it saves
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # so that the output of a library does not count as an answer
    requests: queue.SimpleQueue[Message] = queue.SimpleQueue()
    threading.Thread(target=_take, args=(requests,), daemon=True).start()
    answers.write(READY)
    answers.flush()
    try:
        worker = getattr(import_module(module), name)()
        while True:
            method, arguments = _unpacked(requests.get())
            getattr(worker, method)(*arguments)
            _write(answers, _packed(None))
    except Exception as fault:
        _write(answers, _pickled(fault))


def _take(requests: "queue.SimpleQueue[Message]") -> None:
    """Put each request from standard input into a queue; end this process at the end of standard input.

    Standard input ends when the main process ends.
    """
    try:
        # not `sys.stdin`: at exit the interpreter would wait for its lock forever
        with open(sys.stdin.fileno(), "rb", closefd=False) as given:
            while True:
                requests.put(_read(given))
    finally:
        os._exit(1)


def _pickled(fault: Exception) -> Message:
    """Return an exception as a message; an exception that cannot be pickled becomes a RuntimeError with its text."""
    with suppress(Exception):
        message = _packed(fault)
        _unpacked(message)
        return message
    return _packed(RuntimeError(f"{type(fault).__name__}: {fault}"))


if __name__ == "__main__":
    main(*sys.argv[1:])
