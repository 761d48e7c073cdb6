"""Writes setpoints through a gateway with a client of another project, each value until it is in effect.

    gate_writer.py modbus HOST:PORT FIRST COUNT LEFT RIGHT      registers of the two setpoints
    gate_writer.py opcua HOST:PORT FIRST COUNT FOLDER           certificates of the gateway
    gate_writer.py zenoh HOST:PORT FIRST COUNT

One line of JSON for each value: `stored`, its bits as a REAL, and `outcome`, `in-effect` or `undecided`.
"""

import asyncio
import json
import logging
import shutil
import struct
import sys
import time
from pathlib import Path

# Longer than anything takes on a busy machine.
PATIENCE_S = 120

# Between two attempts, where the first one had no effect.
PAUSE_S = 0.05

STEP = 0.001


def bits(value):
    return struct.unpack(">I", struct.pack(">f", value))[0]


# Of the libraries, so that a connection that ends says why.
logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(message)s")


async def each(write):
    """Write all values. `write` returns `in-effect`, `refused` or `undecided`."""
    first, count = float(sys.argv[3]), int(sys.argv[4])
    for number in range(count):
        value = first + number * STEP
        deadline = time.monotonic() + PATIENCE_S
        while True:
            outcome = await write("left" if number % 2 == 0 else "right", value)
            if outcome != "refused":
                break
            assert time.monotonic() < deadline, value
            await asyncio.sleep(PAUSE_S)
        print(json.dumps({"stored": bits(value), "outcome": outcome}), flush=True)


async def modbus():
    from pymodbus import ModbusException
    from pymodbus.client import AsyncModbusTcpClient

    host, port = sys.argv[2].rsplit(":", 1)
    registers = {"left": int(sys.argv[5]), "right": int(sys.argv[6])}
    client = AsyncModbusTcpClient(host, port=int(port), timeout=PATIENCE_S, retries=0)
    await client.connect()

    async def write(program, value):
        stored = bits(value)
        try:
            answer = await client.write_registers(registers[program], [stored >> 16, stored & 0xFFFF])
        except ModbusException:
            return "undecided"
        if not answer.isError():
            return "in-effect"
        # Server device busy: without an effect. Server device failure: not known.
        return {6: "refused", 4: "undecided"}[answer.exception_code]

    await each(write)
    client.close()


async def opcua():
    from asyncua import Client, ua
    from asyncua.crypto.cert_gen import setup_self_signed_certificate
    from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
    from cryptography.x509.oid import ExtendedKeyUsageOID

    folder = Path(sys.argv[5])
    uri = "urn:localhost:understudy:writer"
    key, certificate = folder / "writer.pem", folder / "writer.der"
    await setup_self_signed_certificate(
        key, certificate, uri, "localhost", [ExtendedKeyUsageOID.CLIENT_AUTH], {"commonName": "writer"}
    )

    def client(user, password):
        # With its default it gives up a server that a busy machine keeps waiting for a second.
        client = Client(f"opc.tcp://{sys.argv[2]}/", timeout=PATIENCE_S, watchdog_intervall=PATIENCE_S)
        client.application_uri = uri
        client.set_user(user)
        client.set_password(password)
        return client

    async def secure(client):
        await client.set_security(
            SecurityPolicyBasic256Sha256, str(certificate), str(key), server_certificate=str(folder / "own/cert.der")
        )
        return client

    async def node(client, path):
        names = await client.get_namespace_array()
        index = next(place for place, name in enumerate(names) if name.startswith("urn:understudy:"))
        return client.get_node(ua.NodeId(path, index))

    async def status_of(node, value, kind):
        try:
            await node.write_value(ua.DataValue(ua.Variant(value, kind)))
        except ua.UaStatusCodeError as error:
            return type(error).__name__
        return "Good"

    # A client that is not trusted yet is refused, and trusted once its certificate was moved.
    try:
        await (await secure(client("anna", "writes-something"))).connect()
    except ua.UaStatusCodeError as error:
        assert type(error).__name__ in ["BadCertificateUntrusted", "BadSecurityChecksFailed"], error
    for rejected in (folder / "rejected").iterdir():
        shutil.move(rejected, folder / "trusted" / rejected.name)

    speed = "Programs/left/Inputs/speed"
    double = ua.VariantType.Double
    async with await secure(client("vera", "sees-everything")) as viewer:
        assert await status_of(await node(viewer, speed), 1.0, double) == "BadUserAccessDenied"
    async with await secure(client("anna", "writes-something")) as operator:
        limits = await (await node(operator, f"{speed}/EURange")).read_value()
        assert (limits.Low, limits.High) == (0.0, 200.0), limits
        unit = await (await node(operator, f"{speed}/EngineeringUnits")).read_value()
        assert unit.DisplayName.Text == "mm/s", unit
        written = await node(operator, speed)
        assert await status_of(written, 200.5, double) == "BadOutOfRange"
        assert await status_of(written, float("nan"), double) in ["BadTypeMismatch", "BadOutOfRange"]
        assert await status_of(written, True, ua.VariantType.Boolean) == "BadTypeMismatch"
        output = await node(operator, "Programs/left/Inputs/right_wants")
        assert await status_of(output, True, ua.VariantType.Boolean) == "BadUserAccessDenied"

        async def write(program, value):
            status = await status_of(await node(operator, f"Programs/{program}/Inputs/speed"), value, double)
            return {"Good": "in-effect", "BadTimeout": "undecided", "BadInvalidState": "refused"}[status]

        await each(write)


async def zenoh():
    sys.path.insert(0, str(Path(__file__).parents[2] / "clients/python"))
    from understudy_client import Client, WriteRefused, WriteUndecided

    with Client(sys.argv[2]) as client:
        deadline = time.monotonic() + PATIENCE_S
        while True:
            try:
                client.run()
                break
            except LookupError:
                assert time.monotonic() < deadline
                time.sleep(PAUSE_S)
        for input, value, code in [("speed", 200.5, "U0642"), ("speed", "fast", "U0641"), ("gone", 1, "U0640")]:
            try:
                client.write("left-io", input, value, reason="a test", owner="otto")
            except WriteRefused as error:
                assert error.code == code, error
            else:
                raise AssertionError(f"{input}={value} was written")

        async def write(program, value):
            try:
                cycle = client.write(f"{program}-io", "speed", value, reason="a test", owner="otto")
            except WriteRefused:
                return "refused"
            except WriteUndecided:
                return "undecided"
            assert cycle > 0
            return "in-effect"

        await each(write)


asyncio.run({"modbus": modbus, "opcua": opcua, "zenoh": zenoh}[sys.argv[1]]())
