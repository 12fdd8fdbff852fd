"""What the system denies, in words: a file, a directory, a stream, a thread, a process, a socket, memory."""

import errno
import os

_ADVICE = {
    errno.EMFILE: "too few open files are allowed (ulimit -n): allow more",
    errno.ENFILE: "this machine has too many files open: close some",
    errno.EAGAIN: "too few processes and threads are allowed (ulimit -u), or too many run: allow more, or end some",
    errno.ENOMEM: "there is no memory left: free some, or allow more (ulimit -v)",
}
_NO_THREAD = "can't start new thread"


def denied(error: BaseException) -> str:
    """What was denied and what to do; "": this is no denial but an error of the program."""
    if isinstance(error, BaseExceptionGroup):
        return denied(error.exceptions[0])
    if isinstance(error, MemoryError):
        return _ADVICE[errno.ENOMEM]
    if isinstance(error, RuntimeError) and str(error) == _NO_THREAD:
        return f"a thread: {_ADVICE[errno.EAGAIN]}"
    if isinstance(error, ImportError):
        why = error.__cause__ or error  # numpy wraps it in a page of advice
        return f"a part of the program cannot be loaded ({why}): install it again, or allow more memory (ulimit -v)"
    if not isinstance(error, OSError):
        return ""
    reason = _ADVICE.get(error.errno or 0) or error.strerror or str(error)
    files = [os.fsdecode(name) for name in (error.filename, error.filename2) if isinstance(name, str | bytes)]
    return ": ".join([" to ".join(files), reason] if files else [reason])
