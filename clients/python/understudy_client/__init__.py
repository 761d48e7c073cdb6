"""Reads what `understudy gateway zenoh` says of a run: states, values, margin, events. It cannot write."""

from .client import Client, Event, Program

__all__ = ["Client", "Event", "Program"]
