"""Client of a Zenoh gateway. docs/reference/zenoh-keys.md describes the keys and documents."""

from __future__ import annotations

import json
import queue
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import zenoh

#: A value of an input or output.
Value = bool | int | float | None


@dataclass(frozen=True)
class Program:
    """The process image of a program at its remote I/O."""

    name: str
    #: Source of the applied outputs: `direct`, `reconstructed`, `held` or `fail-safe`; None before the first deadline.
    source: str | None
    #: By name: a BOOL as `bool`, an integer, bit string or time (in nanoseconds) as `int`, a REAL or LREAL as `float`, or None where it is not finite.
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
            raise LookupError(f"the gateway has not published `{key}` yet")
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
