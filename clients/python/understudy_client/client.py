"""Client of a Zenoh gateway. docs/reference/zenoh-keys.md describes the keys and documents."""

from __future__ import annotations

import getpass
import json
import queue
import secrets
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import zenoh

#: A value of an input or output.
Value = bool | int | float | str | None


@dataclass(frozen=True)
class Program:
    """The process image of a program at its remote I/O."""

    name: str
    #: Source of the applied outputs: `direct`, `reconstructed`, `held` or `fail-safe`; None before the first deadline.
    source: str | None
    #: By name: a BOOL as `bool`, an integer, bit string or time (in nanoseconds) as `int`, a REAL or LREAL as `float`, or None where it is not finite, a
    #: date or a value of an enumeration as `str`.
    inputs: dict[str, Value] | None
    outputs: dict[str, Value] | None
    #: Number of deadlines by source.
    deadlines: dict[str, int]
    #: The program fault that has stopped it, in words.
    fault: str | None = None


@dataclass(frozen=True)
class Event:
    """An event of the run."""

    number: int
    cycle: int
    name: str
    event: str
    level: str
    text: str
    cause: str | None


class WriteError(Exception):
    """A write that is not in effect. `code` is the stable code, as in the documentation of errors."""

    def __init__(self, code: str, message: str):
        super().__init__(f"{code}: {message}")
        self.code = code


class WriteRefused(WriteError):
    """The write has no effect."""


class WriteUndecided(WriteError):
    """The write may have an effect: read the input, or the journal."""


#: A session is not used again after this time in seconds, because the remote I/O may have forgotten it.
_UNUSED_FOR_S = 30.0

#: Time for one answer in seconds: the gateway itself repeats a write for 40 s.
_ANSWER_S = 45.0


@dataclass
class _Session:
    """Identifiers of the writes to one remote I/O."""

    session: int = 0
    number: int = 0
    used: float = 0.0

    def begin(self) -> dict[str, int]:
        """Return the identifier of the next write."""
        if self.number == 0 or time.monotonic() - self.used > _UNUSED_FOR_S:
            self.session, self.number = secrets.randbits(64), 1
        return {"session": self.session, "number": self.number}

    def end(self, answer: dict[str, Any]) -> None:
        """Note an outcome: the number of a write without an effect is free again."""
        self.used = time.monotonic()
        if answer["outcome"] == "in-effect":
            self.number += 1
        elif answer["outcome"] == "undecided" or answer["code"] == "U0644":
            self.number = 0


class Client:
    """A connection to a gateway, such as `Client("127.0.0.1:7447")`; a context manager.

    `cluster` selects a cluster if the network has gateways of several clusters.
    """

    def __init__(self, address: str, cluster: str = "*", timeout: float = 5.0):
        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", json.dumps([f"tcp/{address}"]))
        config.insert_json5("scouting/multicast/enabled", "false")
        self._session = zenoh.open(config)
        self._root = f"understudy/mirror/{cluster}"
        self._timeout = timeout
        self._cluster = ""
        self._sessions: dict[str, _Session] = {}
        self._writing = threading.Lock()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection."""
        self._session.close()

    def _get(self, key: str) -> dict[str, Any]:
        """Return the newest documents, by the last parts of their keys."""
        replies = self._session.get(f"{self._root}/{key}", timeout=self._timeout)
        found = {}
        for reply in replies:
            if reply.ok is not None:
                _, _, _, end = str(reply.ok.key_expr).split("/", 3)
                found[end] = json.loads(reply.ok.payload.to_string())
        return found

    def _one(self, key: str) -> Any:
        found = self._get(key)
        if key not in found:
            raise LookupError(f"the gateway has not published `{key}` yet, or did not answer within {self._timeout:g} s")
        return found[key]

    def run(self) -> dict[str, Any]:
        """Return the state of the run: `run`, `cycle`, `period_us`, `mode`, `timing`."""
        return self._one("run")

    def stations(self) -> list[dict[str, Any]]:
        """Return all stations, each with its `name` and `state`."""
        return self._one("stations")

    def margin(self) -> dict[str, Any]:
        """Return the remaining redundancy (further failures that would be masked): `survives`, `singles`, `pairs`."""
        return self._one("margin")

    def alarms(self) -> list[dict[str, Any]]:
        """Return the open alarms."""
        return self._one("alarms")

    def programs(self) -> dict[str, Program]:
        """Return all programs by name, with their values."""
        return {
            key.removeprefix("programs/"): _program(key, document)
            for key, document in sorted(self._get("programs/*").items())
        }

    def program(self, name: str) -> Program:
        """Return one program."""
        return _program(f"programs/{name}", self._one(f"programs/{name}"))

    def write(
        self, name: str, input: str, value: bool | int | float | str, *, reason: str, owner: str | None = None
    ) -> int:
        """Write `value` to an operator input of the remote I/O `name` and return the cycle from which it is in effect.

        The gateway needs `--allow-writes`. `owner` is the user of this process where it is not given. A lost answer is asked for again
        under the same identifier, which has one effect. One write of a client is under way at a time.

        Raise WriteRefused if the write has no effect, and WriteUndecided if that is not known.
        """
        self._cluster = self._cluster or self.run()["cluster"]
        key = f"understudy/mirror/{self._cluster}/write"
        question = {"name": name, "input": input, "value": value, "owner": owner or getpass.getuser(), "reason": reason}
        with self._writing:
            session = self._sessions.setdefault(name, _Session())
            answer = self._ask(key, {"id": session.begin(), **question})
            session.end(answer)
            if answer.get("code") == "U0644":
                # The remote I/O has forgotten the session, and has not taken the write.
                answer = self._ask(key, {"id": session.begin(), **question})
                session.end(answer)
        if answer["outcome"] == "in-effect":
            return answer["cycle"]
        error = WriteUndecided if answer["outcome"] == "undecided" else WriteRefused
        raise error(answer["code"], answer["message"])

    def _ask(self, key: str, question: dict[str, Any]) -> dict[str, Any]:
        """Return the answer to a write; a lost one is asked for a second time."""
        for _ in range(2):
            asked = time.monotonic()
            for reply in self._session.get(key, payload=json.dumps(question), timeout=_ANSWER_S):
                if reply.ok is not None:
                    return json.loads(reply.ok.payload.to_string())
            if time.monotonic() - asked < 1.0:
                break
        return {"outcome": "undecided", "code": "U0648", "message": "no answer: does the gateway run with --allow-writes?"}

    def events(self) -> Iterator[Event]:
        """Yield each new event, without end."""
        for _, document in self._follow("events"):
            yield Event(**{field: document[field] for field in Event.__dataclass_fields__})

    def values(self, name: str) -> Iterator[Program]:
        """Yield a program after each change, without end."""
        for key, document in self._follow(f"programs/{name}"):
            yield _program(key, document)

    def _follow(self, key: str) -> Iterator[tuple[str, Any]]:
        samples: queue.Queue[Any] = queue.Queue(maxsize=10_000)

        def take(sample: Any) -> None:
            try:
                samples.put_nowait(sample)
            except queue.Full:
                pass  # A slow reader misses the newest samples.

        subscriber = self._session.declare_subscriber(f"{self._root}/{key}", take)
        try:
            while True:
                sample = samples.get()
                _, _, _, end = str(sample.key_expr).split("/", 3)
                yield end, json.loads(sample.payload.to_string())
        finally:
            subscriber.undeclare()


def _program(key: str, document: dict[str, Any]) -> Program:
    return Program(
        name=key.removeprefix("programs/"),
        source=document["source"],
        inputs=document["inputs"],
        outputs=document["outputs"],
        deadlines=document["deadlines"],
        fault=document.get("fault"),
    )
