"""Client of `understudy gateway zenoh`: reads the states, values, remaining redundancy and events of a run, and writes operator inputs."""

from .client import Client, Event, Program, WriteError, WriteRefused, WriteUndecided

__all__ = ["Client", "Event", "Program", "WriteError", "WriteRefused", "WriteUndecided"]
