"""A tank behind a Modbus TCP device, simulated with pymodbus (3.16.1), which is independent of Understudy.

    python3 device.py [PORT]

Coil 0 is the valve: the level rises while it is set and falls otherwise. Discrete inputs 0 and 1 are "below the lower
mark" and "above the upper mark". Bit 0 of holding register 10 is the operator's switch, and bit 3 of holding register 20
is a lamp.

A word on standard input selects the behaviour: `refuse` answers with exceptions, `silent` does not answer, `well`
answers normally. The device ends at the end of standard input. It prints `ready` to standard output, and
`level L valve V lamp P` when the valve changes.
"""

import asyncio
import sys

from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

STEP_SECONDS = 0.01
LOWER, UPPER = 30, 60
VALVE, SWITCH, LAMP = 0, 10, 20


class Tank:
    """The plant, and the behaviour of its device."""

    def __init__(self):
        self.behaviour = "well"
        self.level = 0
        self.valve = False
        self.lamp = False

    async def answer(self, function, start, address, count, registers, values):
        """Called by pymodbus for each request before the answer."""
        while self.behaviour == "silent":
            await asyncio.sleep(STEP_SECONDS)
        if self.behaviour == "refuse":
            return ExcCodes.DEVICE_FAILURE
        if function == 2:
            registers[0] = (self.level < LOWER) | (self.level > UPPER) << 1
        elif values and function in (5, 15) and address == VALVE:
            self.turn(bool(values[0]))
        elif values and function in (6, 16) and address == LAMP:
            self.lamp = bool(values[0] >> 3 & 1)
        return None

    def turn(self, valve):
        if valve != self.valve:
            self.valve = valve
            print(f"level {self.level} valve {int(valve)} lamp {int(self.lamp)}", flush=True)

    async def flow(self):
        while True:
            self.level = max(0, self.level + (1 if self.valve else -1))
            await asyncio.sleep(STEP_SECONDS)

    def device(self):
        bits = [SimData(0, values=[False] * 16, datatype=DataType.BITS)]
        discrete = [SimData(0, values=[False] * 16, datatype=DataType.BITS)]
        registers = [0] * 32
        registers[SWITCH] = 1
        holding = [SimData(0, values=registers, datatype=DataType.REGISTERS)]
        inputs = [SimData(0, values=[0] * 8, datatype=DataType.REGISTERS)]
        return SimDevice(1, simdata=(bits, discrete, holding, inputs), action=self.answer)


async def main():
    port = int(sys.argv[1]) if len(sys.argv) > 1 else 5020
    tank = Tank()
    server = ModbusTcpServer(tank.device(), address=("127.0.0.1", port))
    await server.serve_forever(background=True)
    flowing = asyncio.create_task(tank.flow())
    print("ready", flush=True)
    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        tank.behaviour = line.strip()
    flowing.cancel()
    await server.shutdown()


asyncio.run(main())
