"""What a job of the workflow shows: its log, a bar on the terminal, and a user's mistake without a traceback."""

import errno
import os
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from tqdm import tqdm

LOG_EVERY_S = 10.0
_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG)  # full, over quota, read-only, too large a file


class JobLog:
    """The opened log of one job, and its bar, which is drawn where stderr is a terminal."""

    def __init__(self, log: TextIO, bar: "tqdm[Any]"):
        self._log = log
        self._bar = bar
        self._logged = float("-inf")

    def say(self, text: str) -> None:
        print(text, file=self._log, flush=True)

    def announce(self, text: str) -> None:
        """Lines for whoever started the run: in the log and on the terminal."""
        self.say(text)
        tqdm.write(text, file=sys.stderr)

    def progress(self, done: int, total: int, text: str = "") -> None:
        """How far the job is. Cheap to call often; `text` holds numbers of interest, such as `loss 1.2e-04`."""
        now = time.monotonic()
        if now - self._logged >= LOG_EVERY_S or done == total:
            self._logged = now
            self.say(f"{done}/{total} ({done / total:.0%}) {text}")
        self._bar.total = total
        self._bar.set_postfix_str(text, refresh=False)
        self._bar.update(done - self._bar.n)


@contextmanager
def job_log(label: str, path: str | Path) -> Iterator[JobLog]:
    """Run a job under its log; the label says for people what it works on, as "train case1 base rollout 3-scale".

    A ValueError is a user's mistake: its message goes to the log and the job ends with exit status 1. It ends likewise
    where the disk is full or may not be written; as the log may lie on it, that is said on the terminal. Anything else
    is ours, and goes to the log with its traceback.
    """
    bar = tqdm(desc=label, disable=None, leave=False, dynamic_ncols=True)
    try:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        with bar, Path(path).open("w", encoding="utf-8") as file:
            log = JobLog(file, bar)
            log.say(label)
            try:
                yield log
            except ValueError as error:
                log.say(f"{label}: {error}")
                raise SystemExit(1) from None
            except Exception as error:
                if not isinstance(error, OSError) or error.errno not in _DISK:
                    log.say(traceback.format_exc())
                raise
    except OSError as error:
        if error.errno not in _DISK:
            raise
        where = f"{error.filename}: " if error.filename else ""
        print(f"{label}: {where}{error.strerror}. Make room, or allow writing there; then run again.", file=sys.stderr)
        raise SystemExit(1) from None


def check_folder(folder: str | Path) -> None:
    """Raise a ValueError where something else than a folder has its name."""
    if Path(folder).exists() and not Path(folder).is_dir():
        raise ValueError(f"{Path(folder).resolve()} is no folder; nothing was run. Move it, or give it another name.")


def check_writable(folder: str | Path) -> None:
    """Raise a ValueError where a folder is there and may not be written."""
    if Path(folder).exists() and not os.access(folder, os.W_OK):
        raise ValueError(f"{Path(folder).resolve()} cannot be written; nothing was run. Allow writing there.")
