# Reads a dashboard by Grafana's own model and fails where it is read as something else. Exit status 77 without that model
# (pip install grafana-foundation-sdk).
import json
import sys

try:
    from grafana_foundation_sdk.cog.encoder import JSONEncoder
    from grafana_foundation_sdk.cog.plugins import register_default_plugins
    from grafana_foundation_sdk.models.dashboard import Dashboard
except ImportError as error:
    print(error, file=sys.stderr)
    sys.exit(77)


def differences(ours, theirs, place):
    if isinstance(ours, dict) and isinstance(theirs, dict):
        for key, value in ours.items():
            yield from differences(value, theirs.get(key), f"{place}/{key}")
    elif isinstance(ours, list) and isinstance(theirs, list) and len(ours) == len(theirs):
        for number, (one, other) in enumerate(zip(ours, theirs)):
            yield from differences(one, other, f"{place}/{number}")
    elif ours != theirs:
        yield f"{place}: {ours!r} is read as {theirs!r}"


register_default_plugins()
with open(sys.argv[1], encoding="utf-8") as file:
    ours = json.load(file)
found = list(differences(ours, json.loads(JSONEncoder().encode(Dashboard.from_json(ours))), ""))
print("\n".join(found), file=sys.stderr)
sys.exit(1 if found else 0)
