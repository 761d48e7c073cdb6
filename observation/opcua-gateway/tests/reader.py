"""Reads a gateway with asyncua, a client of another project, and checks what it reads.

    reader.py clear URL
    reader.py follow URL
    reader.py level URL
    reader.py present URL CYCLE
    reader.py secure URL FOLDER USER PASSWORD
"""

import asyncio
import shutil
import sys
from pathlib import Path
from unittest import mock

from asyncua import Client, ua
from asyncua.crypto.cert_gen import setup_self_signed_certificate
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256, SecurityPolicyAes256Sha256RsaPss
from cryptography.x509.oid import ExtendedKeyUsageOID

NAMESPACE = "urn:understudy:"

# Longer than anything takes on a busy machine.
PATIENCE_S = 120


async def index(client):
    names = await client.get_namespace_array()
    return next(place for place, name in enumerate(names) if name.startswith(NAMESPACE))


async def node(client, path):
    return client.get_node(ua.NodeId(path, await index(client)))


async def data(client, path):
    return await (await node(client, path)).read_data_value(raise_on_bad_status=False)


async def until(client, path, value):
    async with asyncio.timeout(PATIENCE_S):
        while (await data(client, path)).Value.Value != value:
            await asyncio.sleep(0.05)


async def variables(node):
    """All variables below a node, by path."""
    found = {}
    for child in await node.get_children():
        name = (await child.read_browse_name()).Name
        if await child.read_node_class() == ua.NodeClass.Variable:
            found[name] = child
        else:
            for path, variable in (await variables(child)).items():
                found[f"{name}/{path}"] = variable
    return found


async def refused(awaitable, *names):
    try:
        await awaitable
    except ua.UaStatusCodeError as error:
        assert type(error).__name__ in names, error
    else:
        raise AssertionError("it was not refused")


async def clear(url):
    async with Client(url) as client:
        await until(client, "Run/State", "finished")
        root = await client.nodes.objects.get_child(f"{await index(client)}:{await cluster(client)}")
        found = await variables(root)
        assert len(found) > 30, found
        for path, variable in found.items():
            assert variable.nodeid.Identifier == path, path
            assert (await variable.read_description()).Text, path
            value = await variable.read_data_value(raise_on_bad_status=False)
            assert value.SourceTimestamp is not None and value.StatusCode is not None, path
            wanted = (await variable.read_data_type()).Identifier
            assert value.Value.VariantType.value == wanted, (path, value)
        # A finished run: what was true is the last that is known, and what was counted is good.
        ended = ua.StatusCodes.UncertainNoCommunicationLastUsableValue
        outputs = [path for path in found if "/robot/Outputs/" in path]
        assert outputs
        for path in outputs:
            assert (await data(client, path)).StatusCode.value == ended, path
        assert (await data(client, "Programs/robot/Source")).Value.Value == "reconstructed"
        assert (await data(client, "Programs/robot/WordOf")).Value.Value == "understudy"
        counted = await data(client, "Programs/robot/Reconstructed")
        assert counted.StatusCode.is_good() and counted.Value.Value > 30, counted
        assert (await data(client, "Programs/robot/Held")).Value.Value == 0
        assert (await data(client, "Margin/Survives")).Value.Value == 0
        assert len((await data(client, "Events/Recent")).Value.Value) > 0
        # Nothing can be written, added or taken away.
        output = found[outputs[0]]
        await refused(
            output.write_value(True), "BadNotWritable", "BadUserAccessDenied", "BadWriteNotSupported"
        )
        await refused(
            output.write_attribute(ua.AttributeIds.DisplayName, ua.DataValue(ua.LocalizedText("x"))),
            "BadNotWritable", "BadUserAccessDenied", "BadWriteNotSupported",
        )
        try:
            await client.delete_nodes([output])
        except ua.UaStatusCodeError:
            pass
        assert (await output.read_display_name()).Text == outputs[0].rsplit("/", 1)[1]
        await refused((await node(client, "gone")).read_value(), "BadNodeIdUnknown")


async def cluster(client):
    return (await client.get_namespace_array())[await index(client)][len(NAMESPACE):]


class Heard:
    def __init__(self):
        self.values = asyncio.Queue()
        self.events = asyncio.Queue()

    def datachange_notification(self, node, value, data):
        monitored = data.monitored_item.Value
        self.values.put_nowait((node.nodeid.Identifier, value, monitored.StatusCode))

    def event_notification(self, event):
        self.events.put_nowait(event)


async def follow(url):
    heard = Heard()
    async with Client(url) as client:
        subscription = await client.create_subscription(100, heard)
        paths = ["Run/Cycle", "Programs/robot/Source", "Run/State"]
        nodes = [await node(client, path) for path in paths]
        await subscription.subscribe_data_change(nodes)
        await subscription.subscribe_events(queuesize=100)
        print("subscribed", flush=True)
        cycles, sources = [], []
        async with asyncio.timeout(PATIENCE_S):
            while True:
                path, value, status = await heard.values.get()
                if path == "Run/Cycle" and status.is_good():
                    cycles.append(value)
                    if len(cycles) == 1:
                        print("seen", flush=True)
                if path == "Programs/robot/Source" and value is not None:
                    sources.append(value)
                if path == "Run/State" and value == "finished":
                    break
            event = await heard.events.get()
            while event.SourceName != "robot":
                event = await heard.events.get()
        assert 1 <= event.Severity <= 1000 and event.Message.Text, event
        assert cycles == sorted(cycles) and sources[-1] == "reconstructed", (cycles, sources)
        print("seen", flush=True)


async def level(url):
    """Prints each service level and each state of the run, until the run has ended."""
    heard = Heard()
    async with Client(url) as client:
        subscription = await client.create_subscription(50, heard)
        service_level = client.get_node(ua.NodeId(ua.ObjectIds.Server_ServiceLevel, 0))
        nodes = [service_level, await node(client, "Run/State")]
        await subscription.subscribe_data_change(nodes, queuesize=1000, sampling_interval=0)
        async with asyncio.timeout(PATIENCE_S):
            while True:
                identifier, value, status = await heard.values.get()
                if identifier == "Run/State":
                    print("state", value, status.name, flush=True)
                else:
                    print("level", value, flush=True)
                    # The level is read as it is told.
                    if value == 10:
                        assert await service_level.read_value() == 10
                        break


async def present(url, cycle):
    """From the first moment on: every value waits, or is that of the last cycle."""
    print("ready", flush=True)
    async with asyncio.timeout(PATIENCE_S):
        while True:
            client = Client(url, timeout=60)
            try:
                await client.connect()
                break
            except (OSError, asyncio.TimeoutError):
                await asyncio.sleep(0.01)
    waited = 0
    try:
        paths = ["Run/State", "Run/Cycle", "Margin/Survives", "Alarms/Open", "Stations/robot/State",
                 "Programs/robot/Source", "Programs/robot/Direct", "Programs/robot/Protected"]
        ids = [(await node(client, path)).nodeid for path in paths]
        params = ua.ReadParameters()
        params.NodesToRead = [ua.ReadValueId(NodeId=id, AttributeId=ua.AttributeIds.Value) for id in ids]
        async with asyncio.timeout(PATIENCE_S):
            while True:
                values = await client.uaclient.read(params)
                found = dict(zip(paths, values))
                waits = [value.StatusCode.value == ua.StatusCodes.BadWaitingForInitialData for value in values]
                if any(waits):
                    assert all(waits), found
                    waited += 1
                    continue
                assert found["Run/Cycle"].Value.Value == int(cycle), (waited, found)
                assert found["Stations/robot/State"].Value.Value == "killed", (waited, found)
                assert found["Margin/Survives"].Value.Value == 0, (waited, found)
                assert found["Programs/robot/Source"].Value.Value == "reconstructed", (waited, found)
                assert found["Programs/robot/Protected"].Value.Value is False, (waited, found)
                break
        assert waited > 0, "the journal is long enough to be seen read"
    finally:
        await client.disconnect()


async def secure(url, folder, user, password):
    folder = Path(folder)
    uri = "urn:localhost:understudy:reader"
    key, certificate = folder / "reader.pem", folder / "reader.der"
    await setup_self_signed_certificate(
        key, certificate, uri, "localhost", [ExtendedKeyUsageOID.CLIENT_AUTH], {"commonName": "reader"}
    )

    async def client(policy, user, password, mode=ua.MessageSecurityMode.SignAndEncrypt):
        client = Client(url)
        client.application_uri = uri
        client.set_user(user)
        client.set_password(password)
        await client.set_security(
            policy, str(certificate), str(key), server_certificate=str(folder / "own/cert.der"), mode=mode
        )
        return client

    async def reads(client):
        async with client:
            await until(client, "Run/State", "finished")

    # Nobody is served in the clear, not even a client that asks for what is not offered.
    with mock.patch.object(Client, "find_endpoint", lambda endpoints, *_: endpoints[0]):
        await refused(reads(Client(url)), "BadTcpEndpointUrlInvalid", "BadIdentityTokenRejected")
    basic = SecurityPolicyBasic256Sha256
    await refused(
        reads(await client(basic, user, password)), "BadCertificateUntrusted", "BadSecurityChecksFailed"
    )
    rejected = list((folder / "rejected").iterdir())
    assert len(rejected) == 1, rejected
    shutil.move(rejected[0], folder / "trusted" / rejected[0].name)
    wrong = ["BadIdentityTokenRejected", "BadUserAccessDenied", "BadIdentityTokenInvalid"]
    await refused(reads(await client(basic, user, password + "!")), *wrong)
    await refused(reads(await client(basic, "somebody", password)), *wrong)
    for policy in [basic, SecurityPolicyAes256Sha256RsaPss]:
        for mode in [ua.MessageSecurityMode.Sign, ua.MessageSecurityMode.SignAndEncrypt]:
            await reads(await client(policy, user, password, mode))


asyncio.run({"clear": clear, "follow": follow, "level": level, "present": present, "secure": secure}[sys.argv[1]](*sys.argv[2:]))
