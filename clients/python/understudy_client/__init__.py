"""Client of `understudy gateway zenoh`: reads the states, values, remaining redundancy and events of a run."""

from .client import Client, Event, Program

__all__ = ["Client", "Event", "Program"]
