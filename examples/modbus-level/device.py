"""A tank behind a Modbus device, simulated with pymodbus (3.16.1), which is independent of Understudy.

    python3 device.py [PORT]
    python3 device.py rtu

Input registers 0 and 1 are the level in metres, a REAL. Holding register 0 is the opening of the inlet valve in
hundredths of a per cent. Bit 0 of holding register 10 is the operator's switch, and coil 0 is the alarm lamp.

With `rtu`, the device is on a serial line without parity, a pair of pseudo terminals; it needs pyserial. It prints
`line PATH`.

A word on standard input selects the behaviour: `nan` answers with a level that is not a number, `well` answers normally.
`show` prints `level L inflow I`. The device ends at the end of standard input. It prints `ready` to standard output, and
`filled` when the level passes 1.9 m.
"""

import asyncio
import math
import os
import struct
import sys
import tty

from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

STEP_SECONDS = 0.01
INLET, SWITCH = 0, 10


class Tank:
    """The plant, and the behaviour of its device."""

    def __init__(self):
        self.behaviour = "well"
        self.level = 0.5
        self.inflow = 0

    async def answer(self, function, start, address, count, registers, values):
        """Called by pymodbus for each request before the answer."""
        if function == 4:
            level = math.nan if self.behaviour == "nan" else self.level
            registers[0:2] = struct.unpack(">HH", struct.pack(">f", level))
        elif values and function in (6, 16) and address == INLET:
            self.inflow = values[0]
        return None

    async def flow(self):
        filled = False
        while True:
            rate = 0.02 * self.inflow / 100 - 0.4 * math.sqrt(self.level)
            self.level = max(0.0, self.level + STEP_SECONDS * rate)
            if not filled and self.level > 1.9:
                filled = True
                print("filled", flush=True)
            await asyncio.sleep(STEP_SECONDS)

    def device(self):
        bits = [SimData(0, values=[False] * 16, datatype=DataType.BITS)]
        discrete = [SimData(0, values=[False] * 16, datatype=DataType.BITS)]
        registers = [0] * 32
        registers[SWITCH] = 1
        holding = [SimData(0, values=registers, datatype=DataType.REGISTERS)]
        inputs = [SimData(0, values=[0] * 8, datatype=DataType.REGISTERS)]
        return SimDevice(1, simdata=(bits, discrete, holding, inputs), action=self.answer)


def serial_line(loop):
    """Two pseudo terminals, connected back to back: the path for the device, and the path for the remote I/O."""
    pairs = [os.openpty(), os.openpty()]
    for (master, slave), (other, _) in (pairs, pairs[::-1]):
        tty.setraw(slave)
        loop.add_reader(master, lambda source=master, target=other: os.write(target, os.read(source, 4096)))
    return [os.ttyname(slave) for _, slave in pairs]


async def main():
    loop = asyncio.get_running_loop()
    tank = Tank()
    if sys.argv[1:] == ["rtu"]:
        own, line = serial_line(loop)
        server = ModbusSerialServer(tank.device(), port=own, baudrate=19200, parity="N")
        print(f"line {line}", flush=True)
    else:
        port = int(sys.argv[1]) if len(sys.argv) > 1 else 5021
        server = ModbusTcpServer(tank.device(), address=("127.0.0.1", port))
    await server.serve_forever(background=True)
    flowing = asyncio.create_task(tank.flow())
    print("ready", flush=True)
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        if line.strip() == "show":
            print(f"level {tank.level:.2f} inflow {tank.inflow}", flush=True)
        else:
            tank.behaviour = line.strip()
    flowing.cancel()
    await server.shutdown()


asyncio.run(main())
