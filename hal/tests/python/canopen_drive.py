"""A CiA 402 drive based on Python's canopen, an independent CANopen stack. This script adds the state machine.

    canopen_drive.py INTERFACE NODE

The library provides SDO server, NMT, heartbeat, emergency messages and the packing of PDOs; the master writes the PDO mapping
into the object dictionary. Each line on stdin is answered by one line on stdout:

    show          state of the power stage, followed target in per mille, NMT state
    fault CODE    sends an emergency message with this code (hexadecimal) and enters the state Fault

It does not monitor the heartbeat of its master, because the library does not. The simulated drive of bench-hal does.
"""

import struct
import sys
import threading

import canopen
from canopen.objectdictionary import ODArray, ODRecord, ODVariable, ObjectDictionary, datatypes

U8, U16, U32 = datatypes.UNSIGNED8, datatypes.UNSIGNED16, datatypes.UNSIGNED32
I8, I16 = datatypes.INTEGER8, datatypes.INTEGER16
OFF = 1 << 31

SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED, FAULT = 0x40, 0x21, 0x23, 0x27, 0x08
VOLTAGE_AND_REMOTE, FOLLOWS_TARGET = 0x0210, 0x1000


def variable(name, kind, default, index, sub=0, access="rw"):
    new = ODVariable(name, index, sub)
    new.data_type, new.default, new.access_type = kind, default, access
    return new


def several(container, name, index, members):
    """An array or record: sub-index 0 and the following ones."""
    new = container(name, index)
    for sub, (kind, default) in members.items():
        new.add_member(variable(f"{name} {sub}", kind, default, index, sub))
    return new


def pdo(objects, communication, mapping, cob_id):
    parameters = {0: (U8, 5), 1: (U32, cob_id), 2: (U8, 255), 3: (U16, 0), 5: (U16, 0)}
    objects.add_object(several(ODRecord, f"PDO {communication:X}", communication, parameters))
    entries = {0: (U8, 0), **{sub: (U32, 0) for sub in range(1, 9)}}
    objects.add_object(several(ODArray, f"PDO {mapping:X}", mapping, entries))


def dictionary(node_id):
    objects = ObjectDictionary()
    pdo(objects, 0x1400, 0x1600, 0x200 + node_id)
    pdo(objects, 0x1800, 0x1A00, 0x180 + node_id)
    objects.add_object(several(ODArray, "consumer heartbeat", 0x1016, {0: (U8, 1), 1: (U32, 0)}))
    identity = {0: (U8, 4), 1: (U32, 0x123), 2: (U32, 0x456), 3: (U32, 0x789), 4: (U32, 42)}
    objects.add_object(several(ODRecord, "identity", 0x1018, identity))
    for index, kind, default, access in [
        (0x1000, U32, 0x00020192, "ro"),
        (0x1001, U8, 0, "ro"),
        (0x1008, datatypes.VISIBLE_STRING, "independent drive", "ro"),
        (0x1017, U16, 0, "rw"),
        (0x6007, I16, 0, "rw"),
        (0x6040, U16, 0, "rw"),
        (0x6041, U16, SWITCH_ON_DISABLED, "ro"),
        (0x6060, I8, 0, "rw"),
        (0x6061, I8, 0, "ro"),
        (0x6071, I16, 0, "rw"),
        (0x6072, U16, 1500, "rw"),
        (0x6075, U32, 4000, "ro"),
        (0x6077, I16, 0, "ro"),
        (0x6502, U32, 1 << 9, "ro"),
    ]:
        objects.add_object(variable(f"object {index:X}", kind, default, index, access=access))
    return objects


def next_state(state, controlword):
    """The state after a controlword, by the transitions of CiA 402."""
    if state == FAULT:
        return FAULT
    if not controlword & 0x02:
        return SWITCH_ON_DISABLED
    if controlword & 0x07 == 0x06:
        return READY
    if controlword & 0x0F == 0x07:
        return SWITCHED_ON if state in (READY, ENABLED) else state
    if controlword & 0x0F == 0x0F:
        return {READY: SWITCHED_ON, SWITCHED_ON: ENABLED}.get(state, state)
    return state


class Drive:
    def __init__(self, network, node_id):
        self.network, self.node = network, canopen.LocalNode(node_id, dictionary(node_id))
        self.lock = threading.RLock()
        self.state, self.controlword, self.target = SWITCH_ON_DISABLED, 0, 0
        self.waiting_for_sync = None
        network.add_node(self.node)
        self.node.add_write_callback(self.on_write)
        self.node.rpdo[1].add_callback(self.on_set_point)
        network.subscribe(0x000, self.on_nmt)  # after the callback of the library
        network.subscribe(0x080, self.on_sync)
        self.node.nmt.send_command(0)
        self.node.nmt.state = "PRE-OPERATIONAL"

    def on_write(self, index, subindex, od, data):
        if index == 0x6040:
            self.on_controlword(struct.unpack("<H", data)[0])
        elif index == 0x6060:
            self.put(0x6061, data)

    def put(self, index, data):
        self.node.set_data(index, 0, data)

    def on_controlword(self, controlword):
        with self.lock:
            rises = controlword & ~self.controlword & 0x80
            self.controlword = controlword
            if rises and self.state == FAULT:
                self.state = SWITCH_ON_DISABLED
                self.node.emcy.reset()
            else:
                self.state = next_state(self.state, controlword)
            self.update_status()

    def update_status(self):
        """Writes statusword and actual value into the object dictionary and the PDO."""
        enabled = self.state == ENABLED
        status = self.state | VOLTAGE_AND_REMOTE | (FOLLOWS_TARGET if enabled else 0)
        actual = self.target if enabled else 0
        self.put(0x6041, struct.pack("<H", status))
        self.put(0x6077, struct.pack("<h", actual))
        status_pdo = self.node.tpdo[1]
        for entry in status_pdo.map:
            entry.raw = {0x6041: status, 0x6077: actual}[entry.index]

    def on_nmt(self, can_id, data, timestamp):
        self.node.tpdo[1].stop()
        if self.node.nmt.state != "OPERATIONAL":
            return
        with self.lock:
            self.node.rpdo[1].read()
            self.node.tpdo[1].read()
            self.update_status()
            if self.node.tpdo[1].trans_type >= 254:
                self.node.tpdo[1].start(self.node.tpdo[1].event_timer / 1000)

    def on_set_point(self, message):
        if self.node.nmt.state != "OPERATIONAL":
            return
        values = {entry.index: entry.raw for entry in message.map}
        if message.trans_type <= 240:
            self.waiting_for_sync = values
        else:
            self.apply(values)

    def apply(self, values):
        with self.lock:
            self.target = values[0x6071]
            self.on_controlword(values[0x6040])

    def on_sync(self, can_id, data, timestamp):
        status = self.node.tpdo[1]
        if self.node.nmt.state == "OPERATIONAL" and status.trans_type == 1:
            if self.waiting_for_sync is not None:
                self.apply(self.waiting_for_sync)
                self.waiting_for_sync = None
            status.transmit()

    def fail(self, code):
        self.node.emcy.send(code, 0x01)
        with self.lock:
            self.state = FAULT
            self.update_status()


def main():
    network = canopen.Network()
    network.connect(interface="socketcan", channel=sys.argv[1])
    drive = Drive(network, int(sys.argv[2]))
    print("ready", flush=True)
    for line in sys.stdin:
        command, *arguments = line.split()
        if command == "fault":
            drive.fail(int(arguments[0], 16))
        target = drive.target if drive.state == ENABLED else 0
        print(f"{drive.state:02x} {target} {drive.node.nmt.state}", flush=True)
    network.disconnect()


if __name__ == "__main__":
    main()
