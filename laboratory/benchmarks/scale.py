#!/usr/bin/env python3
"""Runs clusters of 1 to 64 controllers and one understudy on this machine, and prints a line for each.

    laboratory/benchmarks/scale.py UNDERSTUDY LINK PROGRAMS:PERIOD:CYCLES ...
    laboratory/benchmarks/scale.py target/release/understudy udp 4:10ms:10000 16:10ms:10000 64:100ms:10000

LINK is udp or zenoh. Every controller runs the press of examples/press-cell; no plant is simulated. A line has the time from the
first process to the first cycle in which all members are synchronised, the cycles without a proved output (all, and those next
to a stall of the host), wrong outputs, UDP datagrams sent in a cycle, and the processor time of a member in a cycle, its journal
included (in parentheses that of the kernel, roughly, because it is counted in ticks of the clock). Datagrams are those of the
whole machine, so nothing else may use UDP meanwhile.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PRESS = Path(__file__).resolve().parents[2] / "examples/press-cell/press.ladder"
KINDS = ["controller", "remote I/O", "understudy"]


def cluster_file(programs, period):
    """The text of a cluster of `programs` controllers that all run the press."""
    text = f'[cluster]\nname = "scale"\nperiod = "{period}"\n'
    for number in range(1, programs + 1):
        text += f'[[controller]]\nname = "c{number}"\nladder = "press.ladder"\n'
        text += f'[[remote_io]]\ncontroller = "c{number}"\n'
    return text + '[[understudy]]\nname = "understudy"\n'


def datagrams():
    """UDP datagrams that this machine has sent."""
    lines = [line.split() for line in open("/proc/net/snmp") if line.startswith("Udp:")]
    return int(lines[1][lines[0].index("OutDatagrams")])


def records(runs):
    """The first records of the journal, as far as it has been written: the members announce themselves there."""
    for journal in runs.glob("20*/journal.jsonl"):
        for line in journal.read_text(errors="replace").splitlines()[:20000]:
            try:
                yield json.loads(line)
            except ValueError:
                return


def processes(runs):
    """The process and the kind of each member, and the times in ns of the first process and of the origin."""
    members, started, origin = {}, None, None
    for record in records(runs):
        event = record["event"]
        if event["event"] == "started" and started is None:
            started = record["at_ns"]
        elif event["event"] == "ready":
            kind = 1 if "remote-io" in record["member"] else 2 if record["name"] == "understudy" else 0
            members[event["process"]] = KINDS[kind]
        elif event["event"] == "origin":
            origin = record["at_ns"]
            break
    return members, started, origin


def processor_time(process):
    """Processor time of a process in seconds, its own and that of the kernel for it, or nothing if it has ended."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return None
    return tuple(int(ticks) / os.sysconf("SC_CLK_TCK") for ticks in fields[11:13])


def measure(understudy, link, programs, period, cycles):
    """Runs one cluster; the cells of its line."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "press.ladder").write_bytes(PRESS.read_bytes())
        (folder / "cluster.toml").write_text(cluster_file(programs, period))
        runs, sent, members, used = folder / "runs", datagrams(), {}, {}
        command = [understudy, "lab", folder / "cluster.toml", "--cycles", str(cycles), "--link", link, "--out", runs, "--json"]
        laboratory = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        origin = started = None
        while laboratory.poll() is None:
            if origin is None:
                members, started, origin = processes(runs)
            used.update({it: spent for it in members if (spent := processor_time(it)) is not None})
            time.sleep(0.5)
        sent = datagrams() - sent
        summaries = list(runs.glob("20*/summary.json"))
        if origin is None or not summaries:
            return ["did not start: " + laboratory.stdout.read().decode(errors="replace")[:300]]
        summary = json.loads(summaries[0].read_text())
    cycles = max(summary["cycles_run"], 1)
    total = {key: sum(io["counts"][key] for io in summary["remote_ios"]) for key in summary["remote_ios"][0]["counts"]}
    stalled = total["held_by_stall"] + total["fail_safe_by_stall"]
    times = []
    for kind in KINDS:
        own = [spent for it, spent in used.items() if members[it] == kind]
        mean = [sum(part) / len(own) / cycles * 1e6 for part in zip(*own)]
        times.append(f"{sum(mean):.0f} µs ({mean[1]:.0f})" if own else "-")
    return [
        str(cycles),
        f"{(origin - started) / 1e9:.1f} s",
        f"{total['held'] + total['fail_safe']} ({stalled})",
        str(total["wrong"]),
        f"{sent / cycles:.0f}" if link == "udp" else "-",
        *times,
    ]


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    understudy, link, *wanted = sys.argv[1:]
    row = "| {:5} | {:>8} | {:>7} | {:>6} | {:>7} | {:>15} | {:>5} | {:>9} | {:>12} | {:>12} | {:>12} |"
    print(row.format("link", "programs", "period", "cycles", "start", "missed (stalls)", "wrong", "datagrams", *KINDS))
    print("|" + "---|" * 11)
    for run in wanted:
        programs, period, cycles = run.split(":")
        cells = measure(os.path.abspath(understudy), link, int(programs), period, int(cycles))
        cells += [""] * (8 - len(cells))
        print(row.format(link, programs, period, *cells), flush=True)


main()
