#!/usr/bin/python3
"""A Modbus drive or sensor by python3-pymodbus, for modbus_peer_test.cpp and python_sensor_test.py:
`modbus_peer.py tcp|rtu|ft300`.

Prints where it listens (a port, a pseudo-terminal) on one line and ends with its standard input. The drive is unit 1 with
registers 0..99, register n holding 1000 + n at first. The sensor is a Robotiq FT 300 by its manual: unit 9 on RTU,
holding registers 180 to 185, hundredths of N and thousandths of Nm, as 16-bit two's complement.
"""
import asyncio
import logging
import os
import sys
import threading
import tty

from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.server.async_io import ModbusSerialServer, ModbusTcpServer
from pymodbus.transaction import ModbusRtuFramer, ModbusSocketFramer


def relay(source, sink):
    while True:
        data = os.read(source, 256)
        if not data:
            return
        os.write(sink, data)


def crossed_terminals():
    """Two pseudo-terminals, what goes into one comes out of the other."""
    ends = [os.openpty() for _ in range(2)]
    for _, slave in ends:
        tty.setraw(slave)
    (a, _), (b, _) = ends
    for pair in ((a, b), (b, a)):
        threading.Thread(target=relay, args=pair, daemon=True).start()
    return [os.ttyname(slave) for _, slave in ends]


async def be_noisy(block):
    """Fz: a count comes and goes."""
    while True:
        await asyncio.sleep(0.01)
        block.setValues(182, [1 - block.getValues(182, 1)[0]])


async def serve(wire):
    unit, block = 1, ModbusSequentialDataBlock(0, [1000 + n for n in range(100)])
    if wire == "ft300":
        unit, block = 9, ModbusSequentialDataBlock(180, [0x04D2, 0xFE0C, 0x0000, 0x0190, 0xFDA8, 0x00FA])
        asyncio.create_task(be_noisy(block))
    units = ModbusServerContext(slaves={unit: ModbusSlaveContext(hr=block, zero_mode=True)}, single=False)
    if wire == "tcp":
        server = ModbusTcpServer(units, framer=ModbusSocketFramer, address=("127.0.0.1", 0))
        task = asyncio.create_task(server.serve_forever())
        while server.server is None:
            await asyncio.sleep(0.01)
        place = server.server.sockets[0].getsockname()[1]
    else:
        own, place = crossed_terminals()
        server = ModbusSerialServer(units, framer=ModbusRtuFramer, port=own, baudrate=115200)
        await server.start()
        task = asyncio.create_task(server.serve_forever())
    print(place, flush=True)
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    task.cancel()


logging.disable()  # of the end, which it takes for a mistake
asyncio.run(serve(sys.argv[1]))
os._exit(0)
