#!/usr/bin/env python3
"""Makes a Python wheel that installs static binaries as commands: `pip install ./understudy-*.whl` gives `understudy`.

    deployment/wheel.py VERSION ARCHITECTURE DIRECTORY NAME=BINARY... [BILL_OF_MATERIALS...]

The binaries are static, so one wheel serves glibc and musl, and every Python 3. It has no dependencies.
SOURCE_DATE_EPOCH is the date of its files. The formats are those of packaging.python.org: "Binary distribution
format", PEP 639 (licences), PEP 770 (bills of materials).
"""

import base64
import hashlib
import os
import sys
import time
import zipfile
from pathlib import Path

REGULAR_FILE = 0o100000


def main(version: str, architecture: str, directory: str, *files: str) -> None:
    platforms = [f"{libc}_{architecture}" for libc in ("manylinux_2_17", "manylinux2014", "musllinux_1_1")]
    name = f"understudy-{version}"
    information = f"{name}.dist-info"
    content: dict[str, tuple[bytes, int]] = {}
    for file in files:
        command, separator, binary = file.partition("=")
        if separator:
            content[f"{name}.data/scripts/{command}"] = (Path(binary).read_bytes(), 0o755)
        else:
            content[f"{information}/sboms/{Path(file).name}"] = (Path(file).read_bytes(), 0o644)
    for licence in ("LICENSE-APACHE", "LICENSE-MIT"):
        content[f"{information}/licenses/{licence}"] = (Path(licence).read_bytes(), 0o644)
    metadata = [
        "Metadata-Version: 2.4",
        "Name: understudy",
        f"Version: {version}",
        "Summary: A redundant array of independent controllers: RAID for PLCs",
        "License-Expression: MIT OR Apache-2.0",
        "License-File: LICENSE-APACHE",
        "License-File: LICENSE-MIT",
        "Classifier: Operating System :: POSIX :: Linux",
        "Requires-Python: >=3.8",
    ]
    wheel = ["Wheel-Version: 1.0", "Generator: understudy", "Root-Is-Purelib: false"]
    wheel += [f"Tag: py3-none-{platform}" for platform in platforms]
    for file, lines in (("METADATA", metadata), ("WHEEL", wheel)):
        content[f"{information}/{file}"] = ("".join(f"{line}\n" for line in lines).encode(), 0o644)
    record = f"{information}/RECORD"
    rows = [f"{path},sha256={digest(data)},{len(data)}\n" for path, (data, _) in content.items()]
    content[record] = ("".join([*rows, f"{record},,\n"]).encode(), 0o644)
    path = Path(directory, f"{name}-py3-none-{'.'.join(platforms)}.whl")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for inner, (data, mode) in content.items():
            archive.writestr(entry(inner, mode), data)


def digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def entry(path: str, mode: int) -> zipfile.ZipInfo:
    moment = time.gmtime(int(os.environ["SOURCE_DATE_EPOCH"]))
    info = zipfile.ZipInfo(path, moment[:6])
    info.compress_type = zipfile.ZIP_DEFLATED
    info.external_attr = (REGULAR_FILE | mode) << 16
    return info


if __name__ == "__main__":
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
