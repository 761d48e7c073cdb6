#!/usr/bin/env python3
"""Makes a container image as an OCI layout in a tar file. It contains static binaries and no other programs.

    deployment/image.py VERSION ARCHITECTURE COMMIT FILE NAME=BINARY...

ARCHITECTURE is amd64 or arm64, as in Go. `podman load`, `docker load` and `skopeo copy oci-archive:FILE` read the
image, and no container engine is needed to make it. SOURCE_DATE_EPOCH is the date of its files. The format is that of the OCI
image specification. `manifest.json` of `docker save` is included for engines that read only this file.
"""

import gzip
import hashlib
import io
import json
import os
import sys
import tarfile
import time
from pathlib import Path

USER = 7450
"""Number of the user `understudy` in the image, also used in compose.yaml and docs/how-to/install.md."""

EPOCH = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
KEYS = "var/lib/understudy"
JOURNALS = "var/log/understudy"


class Archive:
    """A tar file in memory whose bytes depend on its content only."""

    def __init__(self) -> None:
        self.buffer = io.BytesIO()
        self.tar = tarfile.open(fileobj=self.buffer, mode="w", format=tarfile.USTAR_FORMAT)

    def folder(self, path: str, mode: int = 0o755, owner: int = 0) -> None:
        entry = tarfile.TarInfo(path)
        entry.type, entry.mode, entry.mtime, entry.uid, entry.gid = tarfile.DIRTYPE, mode, EPOCH, owner, owner
        self.tar.addfile(entry)

    def file(self, path: str, data: bytes, mode: int = 0o644) -> None:
        entry = tarfile.TarInfo(path)
        entry.size, entry.mode, entry.mtime = len(data), mode, EPOCH
        self.tar.addfile(entry, io.BytesIO(data))

    def bytes(self) -> bytes:
        self.tar.close()
        return self.buffer.getvalue()


def layer(binaries: list[str]) -> bytes:
    tree = Archive()
    for folder in ("etc", "etc/understudy", "usr", "usr/bin", "var", "var/lib", "var/log"):
        tree.folder(folder)
    tree.folder("tmp", 0o1777)
    tree.folder(KEYS, 0o700, USER)
    tree.folder(JOURNALS, 0o700, USER)
    user = f"understudy:x:{USER}:"
    tree.file("etc/passwd", f"root:x:0:0:root:/:/\n{user}{USER}:Understudy:/{KEYS}:/\n".encode())
    tree.file("etc/group", f"root:x:0:\n{user}\n".encode())
    for binary in binaries:
        command, _, path = binary.partition("=")
        tree.file(f"usr/bin/{command}", Path(path).read_bytes(), 0o755)
    return tree.bytes()


def image(version: str, architecture: str, commit: str, binaries: list[str]) -> bytes:
    layout = Archive()
    for folder in ("blobs", "blobs/sha256"):
        layout.folder(folder)

    def blob(kind: str, data: bytes) -> dict:
        digest = hashlib.sha256(data).hexdigest()
        layout.file(f"blobs/sha256/{digest}", data)
        return {"mediaType": f"application/vnd.oci.image.{kind}", "digest": f"sha256:{digest}", "size": len(data)}

    def document(value: object) -> bytes:
        return json.dumps(value, indent=1).encode()

    tree = layer(binaries)
    packed = blob("layer.v1.tar+gzip", gzip.compress(tree, 9, mtime=EPOCH))
    created = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(EPOCH))
    labels = {
        "org.opencontainers.image.title": "understudy",
        "org.opencontainers.image.version": version,
        "org.opencontainers.image.revision": commit,
        "org.opencontainers.image.created": created,
        "org.opencontainers.image.licenses": "MIT OR Apache-2.0",
    }
    settings = {
        "User": f"{USER}:{USER}",
        "Entrypoint": ["/usr/bin/understudy"],
        "Cmd": ["demo"],
        "Env": ["PATH=/usr/bin"],
        "WorkingDir": f"/{JOURNALS}",
        "Labels": labels,
        "StopSignal": "SIGTERM",
    }
    configuration = blob(
        "config.v1+json",
        document({
            "created": created,
            "architecture": architecture,
            "os": "linux",
            "config": settings,
            "rootfs": {"type": "layers", "diff_ids": [f"sha256:{hashlib.sha256(tree).hexdigest()}"]},
            "history": [{"created": created, "created_by": "deployment/image.py"}],
        }),
    )
    kind = "application/vnd.oci.image.manifest.v1+json"
    manifest = {"schemaVersion": 2, "mediaType": kind, "config": configuration, "layers": [packed]}
    found = blob("manifest.v1+json", document(manifest))
    name = f"localhost/understudy:{version}"
    found["platform"] = {"architecture": architecture, "os": "linux"}
    # `ref.name` is the tag for skopeo and podman, `image.name` the name for containerd.
    found["annotations"] = {"org.opencontainers.image.ref.name": version, "io.containerd.image.name": name}
    index = {"schemaVersion": 2, "mediaType": "application/vnd.oci.image.index.v1+json", "manifests": [found]}
    layout.file("oci-layout", document({"imageLayoutVersion": "1.0.0"}))
    layout.file("index.json", document(index))

    def place(descriptor: dict) -> str:
        return "blobs/" + descriptor["digest"].replace(":", "/")

    saved = {"Config": place(configuration), "RepoTags": [name], "Layers": [place(packed)]}
    layout.file("manifest.json", document([saved]))
    return layout.bytes()


if __name__ == "__main__":
    if len(sys.argv) < 6:
        sys.exit(__doc__)
    version, architecture, commit, file, *binaries = sys.argv[1:]
    Path(file).write_bytes(image(version, architecture, commit, binaries))
