"""Reads all points of the program `one` with the Python client, writes other values to its inputs, and reads them again.

    points_client.py HOST:PORT < VALUES

VALUES is a line of JSON: the value of each input, as the client reads it. The answer is a document with `before` and `after`, each with `inputs` and
`outputs`, and `refused`, the code of a wrong value of each input.
"""

import json
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "clients/python"))

from understudy_client import Client, WriteRefused  # noqa: E402

# Longer than anything takes on a busy machine.
PATIENCE_S = 120


def wrong(value):
    """A value of another type."""
    return "nothing such" if not isinstance(value, str) else 3.5


with Client(sys.argv[1]) as client:
    deadline = time.monotonic() + PATIENCE_S

    def read(is_right):
        while True:
            try:
                program = client.program("one")
                if program.inputs and program.outputs and is_right(program):
                    return {"inputs": program.inputs, "outputs": program.outputs}
            except LookupError:
                pass
            assert time.monotonic() < deadline
            time.sleep(0.05)

    wanted = json.loads(sys.stdin.readline())
    before = read(lambda program: True)
    refused = []
    for name, value in wanted.items():
        try:
            client.write("one-io", name, wrong(value), reason="a test")
        except WriteRefused as error:
            refused.append((name, error.code))
        client.write("one-io", name, value, reason="a test")
    outputs = {f"q{name}": value for name, value in wanted.items()}
    after = read(lambda program: program.inputs.items() >= wanted.items() and program.outputs.items() >= outputs.items())
    print(json.dumps({"before": before, "after": after, "refused": refused}))
