#!/usr/bin/env python3
"""Writes the bill of materials of a binary for a target, as CycloneDX 1.5 in JSON.

    deployment/bill_of_materials.py x86_64-unknown-linux-musl [understudy] > understudy.cdx.json

It lists every crate compiled into the binary according to the lock file, with its name, version, licence, source
checksum and dependencies. Build scripts and macros, which run only during the build, have the scope `excluded`.
"""

import json
import subprocess
import sys
import tomllib

def metadata(target: str) -> dict:
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", target]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def reached(nodes: dict, root: str, kinds: set) -> set:
    """Return the packages that `root` requires through dependencies of these kinds."""
    found, waiting = set(), [root]
    while waiting:
        package = waiting.pop()
        if package in found:
            continue
        found.add(package)
        for dependency in nodes[package]["deps"]:
            if any(kind["kind"] in kinds for kind in dependency["dep_kinds"]):
                waiting.append(dependency["pkg"])
    return found


def is_macro(package: dict) -> bool:
    return any("proc-macro" in target["kind"] for target in package["targets"])


def main(target: str, name: str) -> None:
    tree = metadata(target)
    packages = {package["id"]: package for package in tree["packages"]}
    nodes = {node["id"]: node for node in tree["resolve"]["nodes"]}
    root = next(
        package["id"]
        for package in tree["packages"]
        if package["name"] == name and package["source"] is None
    )
    with open("Cargo.lock", "rb") as file:
        locked = tomllib.load(file)["package"]
    checksums = {(entry["name"], entry["version"]): entry.get("checksum") for entry in locked}
    every = reached(nodes, root, {None, "build"})
    linked = {package for package in reached(nodes, root, {None}) if not is_macro(packages[package])}

    def reference(package: str) -> str:
        return f"pkg:cargo/{packages[package]['name']}@{packages[package]['version']}"

    def component(package: str) -> dict:
        known = packages[package]
        checksum = checksums.get((known["name"], known["version"]))
        entry = {
            "type": "library",
            "bom-ref": reference(package),
            "purl": reference(package),
            "name": known["name"],
            "version": known["version"],
            "scope": "required" if package in linked else "excluded",
        }
        if known["license"]:
            # Old manifests separate licences by a slash.
            entry["licenses"] = [{"expression": known["license"].replace("/", " OR ").replace("  ", " ")}]
        if checksum:
            entry["hashes"] = [{"alg": "SHA-256", "content": checksum}]
        return entry

    own = packages[root]
    document = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": reference(root),
                "purl": reference(root),
                "name": own["name"],
                "version": own["version"],
                "licenses": [{"expression": own["license"]}],
            },
            "properties": [{"name": "target", "value": target}],
        },
        "components": [
            component(package) for package in sorted(every - {root}, key=reference)
        ],
        "dependencies": [
            {
                "ref": reference(package),
                "dependsOn": sorted(
                    {
                        reference(dependency["pkg"])
                        for dependency in nodes[package]["deps"]
                        if dependency["pkg"] in every
                    }
                ),
            }
            for package in sorted(every, key=reference)
        ],
    }
    json.dump(document, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2] if len(sys.argv) == 3 else "understudy")
