"""A folder of ours on the disk: written to by one process at a time, and whole or not at all."""

from __future__ import annotations

import errno
import os
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile

from filelock import FileLock, Timeout

LOCK, HOLDER = ".lock", ".holder"
PATIENCE = 0.5  # [s] for who holds a folder to say so
DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS)
"""Errors that come without a file's name where an open file is written to."""


class RecordsError(ValueError):
    """A results folder that cannot be used, in one line."""


class DiskError(RecordsError):
    """What the disk refused while it was used; what was there before stays."""


@contextmanager
def disk_errors(folder: Path, path: Path | None = None) -> Iterator[None]:
    """Make one line, a DiskError, of what the disk refuses in `folder`; other errors pass.

    Parameters
    ----------
    path : the open file that an error is about which names none
    """
    try:
        yield
    except OSError as error:
        where = Path(error.filename) if isinstance(error.filename, str) else path or folder
        ours = folder == where or folder in where.parents
        if not ours or (error.filename is None and error.errno not in DISK):
            raise
        raise DiskError(f"{where}: {error.strerror}; mend that and run again") from error


def open_folder(folder: Path, option: str = "--results") -> None:
    """Make sure that `folder`, given by `option`, can be written to; RecordsError if not."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=folder).close()
    except OSError as error:
        raise RecordsError(
            f"{folder} cannot be written to ({error.strerror}): give {option} a folder of yours"
        ) from None


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold `folder` against other processes; the system lets go of it however we end.

    Raises
    ------
    RecordsError
        If another process holds it, or the disk refuses something in it meanwhile.
    """
    lock = FileLock(folder / LOCK)
    try:
        with disk_errors(folder):
            lock.acquire(timeout=PATIENCE)
    except Timeout:
        raise RecordsError(
            f"{folder} is in use by {_holder(folder) or 'another process'}: wait until that has "
            "ended, or give another --results"
        ) from None
    try:
        with disk_errors(folder):
            write_whole(folder / HOLDER, _ourselves().encode())
            yield
    finally:
        if _holder(folder) == _ourselves():
            with suppress(OSError):  # it says nothing once the lock is released
                (folder / HOLDER).unlink()
        lock.release()


def check_held(folder: Path) -> None:
    """DiskError if the folder that we have locked was taken away, even if there is a new one."""
    if _holder(folder) != _ourselves():
        raise DiskError(f"{folder} was removed or replaced while it was in use; run again")


def _ourselves() -> str:
    return f"process {os.getpid()} on {socket.gethostname()}"


def _holder(folder: Path) -> str:
    try:
        return (folder / HOLDER).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Put Ctrl-C and SIGTERM off to the end of the block; outside the main thread neither comes."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    caught: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = {n: handler for n in numbers if (handler := signal.getsignal(n)) is not None}
    try:
        for each in before:
            signal.signal(each, lambda number, _: caught.append(number))
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
        for number in dict.fromkeys(caught):
            signal.raise_signal(number)


def write_whole(path: Path, content: bytes) -> None:
    """Put `content` in place of a file: whatever happens, the old one or the new one is there."""
    part = path.with_name(f"{path.name}.part")
    with disk_errors(path.parent, path):
        try:
            with part.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            part.replace(path)
        except BaseException:
            with suppress(OSError):  # the first error counts
                part.unlink()
            raise
        _sync(path.parent)


def append_whole(path: Path, content: bytes) -> None:
    """Add `content` to a file and flush it to the disk; the file is as before if that fails."""
    with disk_errors(path.parent, path), path.open("ab", buffering=0) as file:
        before = file.tell()
        try:
            rest = memoryview(content)
            while rest:
                rest = rest[file.write(rest) :]
            os.fsync(file.fileno())
        except BaseException:
            file.truncate(before)
            raise


def cut(path: Path, length: int) -> None:
    """Leave the first `length` bytes of a file, on the disk."""
    with disk_errors(path.parent, path), path.open("r+b") as file:
        file.truncate(length)
        os.fsync(file.fileno())


def _sync(folder: Path) -> None:
    """Flush the names in a folder to the disk, where a system has that."""
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def content_of(path: Path, start: int = 0) -> bytes:
    """What a file holds from a byte on; nothing where there is none."""
    try:
        with path.open("rb") as file:
            file.seek(start)
            return file.read()
    except (FileNotFoundError, NotADirectoryError):
        return b""
    except OSError as error:
        raise RecordsError(f"{path} cannot be read ({error.strerror})") from None
