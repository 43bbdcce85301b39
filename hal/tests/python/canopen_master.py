"""A CANopen master based on Python's canopen, an independent stack, with the simulated drive of bench-hal (node 5).

    canopen_master.py INTERFACE
"""

import struct
import sys
import time

import canopen

NODE = 5
SET_POINT, STATUS, OWN_HEARTBEAT = 0x200 + NODE, 0x180 + NODE, 0x77F


def wait_for(what, condition):
    end = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < end, f"never: {what}"
        time.sleep(0.01)


def refused(transfer, code):
    """The drive must abort the transfer with this code."""
    try:
        transfer()
    except canopen.SdoAbortedError as error:
        assert error.code == code, f"abort {error.code:#010x} instead of {code:#010x}"
        return
    raise AssertionError(f"not refused, expected {code:#010x}")


def objects(sdo):
    assert sdo.upload(0x1008, 0) == b"simulated CANopen drive"  # in segments
    assert sdo.upload(0x1018, 1) == bytes.fromhex("02040000")
    note = b"a note of some twenty bytes and more"
    sdo.download(0x2000, 0, note, force_segment=True)
    assert sdo.upload(0x2000, 0) == note
    refused(lambda: sdo.upload(0x7777, 0), 0x06020000)  # no such object
    refused(lambda: sdo.upload(0x1018, 9), 0x06090011)  # no such sub-index
    refused(lambda: sdo.download(0x6041, 0, b"\0\0"), 0x06010002)  # read only
    refused(lambda: sdo.download(0x6060, 0, b"\x08"), 0x06090030)  # an unsupported mode
    refused(lambda: sdo.download(0x6071, 0, b"\0"), 0x06070010)  # length


def configure(sdo):
    """Cyclic torque mode, asynchronous set-points, status with SYNC."""
    sdo.download(0x1017, 0, struct.pack("<H", 50))
    sdo.download(0x6060, 0, b"\x0a")
    for parameters, cob_id, kind, words in (
        (0x1400, SET_POINT, 255, (0x60400010, 0x60710010)),
        (0x1800, STATUS, 1, (0x60410010, 0x60770010)),
    ):
        mapping = parameters + 0x200
        refused(lambda: sdo.download(mapping, 1, struct.pack("<I", words[0])), 0x06010000)  # the PDO is still enabled
        sdo.download(parameters, 1, struct.pack("<I", cob_id | 1 << 31))
        sdo.download(mapping, 0, b"\0")
        for sub, word in enumerate(words, 1):
            sdo.download(mapping, sub, struct.pack("<I", word))
        sdo.download(mapping, 0, b"\2")
        sdo.download(parameters, 2, bytes([kind]))
        sdo.download(parameters, 1, struct.pack("<I", cob_id))


def drive(network):
    """Operation Enabled, both directions of current, and off."""
    statuses = []
    network.subscribe(STATUS, lambda _id, data, _time: statuses.append(struct.unpack("<Hh", data)))
    for controlword, target, state, actual in (
        (0x06, 0, 0x21, 0),
        (0x07, 0, 0x23, 0),
        (0x07, 250, 0x23, 0),  # a target before Operation Enabled has no effect
        (0x0F, 0, 0x27, 0),
        (0x0F, 250, 0x27, 250),
        (0x0F, -250, 0x27, -250),
        (0x00, 0, 0x40, 0),
        (0x06, 0, 0x21, 0),
        (0x07, 0, 0x23, 0),
        (0x0F, 250, 0x27, 250),
    ):

        def arrived():
            network.send_message(SET_POINT, struct.pack("<Hh", controlword, target))
            network.sync.transmit()
            mask = 0x4F if state == 0x40 else 0x6F
            return bool(statuses) and (statuses[-1][0] & mask, statuses[-1][1]) == (state, actual)

        wait_for(f"controlword {controlword:#x}, target {target}", arrived)


def main():
    network = canopen.Network()
    network.connect(interface="socketcan", channel=sys.argv[1])
    network.scanner.search()
    wait_for("the scanner finds the drive", lambda: NODE in network.scanner.nodes)
    node = network.add_node(canopen.RemoteNode(NODE, canopen.ObjectDictionary()))
    node.sdo.RESPONSE_TIMEOUT = 10
    objects(node.sdo)
    configure(node.sdo)
    # The drive monitors the heartbeat of this master and disables its voltage without it.
    node.sdo.download(0x6007, 0, struct.pack("<h", 2))
    node.sdo.download(0x1016, 1, struct.pack("<I", 0x7F << 16 | 2000))
    heartbeat = network.send_periodic(OWN_HEARTBEAT, b"\5", 0.1)
    node.nmt.state = "OPERATIONAL"
    wait_for("operational", lambda: node.nmt.wait_for_heartbeat(10) == "OPERATIONAL")
    drive(network)
    heartbeat.stop()
    wait_for("the drive misses the heartbeat", lambda: [error.code for error in node.emcy.log] == [0x8130])
    wait_for("pre-operational", lambda: node.nmt.wait_for_heartbeat(10) == "PRE-OPERATIONAL")
    assert struct.unpack("<H", node.sdo.upload(0x6041, 0))[0] & 0x4F == 0x40
    network.disconnect()
    print("all well")


if __name__ == "__main__":
    main()
