"""What drives do otherwise than a master would wish, and what is then to happen: a table.

Each row is played by the simulated far end, once in the program's own process (drive_quirks_test.py) and once by two
processes on a real kernel's CAN (tests/vcan/drive_quirks_test.py). What is expected is what CiA 301 and 402 or the
documentation (docs/reference/buses.md) say, never what the program was seen to do.
"""
import dataclasses

DISPLAY = "feedback: [{object: '0x6061', bits: 8}]"


@dataclasses.dataclass(frozen=True)
class Quirk:
    """One row. `drive` has faults of the drive (text behind `shoulder:`); AT stands for a time in motion.

    lacks    it runs; each of these is in what the drive lacks
    refused  it is refused before anything moves; the message has each of these words
    fault    it runs until this fault, whose text has `words`, `within_cycles` of AT
    """
    name: str
    drive: tuple
    cell: tuple = ()
    simulation: str = ""
    lacks: tuple = ()
    refused: tuple = ()
    fault: str = ""
    words: tuple = ()
    within_cycles: int = 0
    arguments: tuple = ()
    own_process_only: str = ""  # why it can't be played by two processes


def quirks():
    rows = []

    def runs(name, *drive, **rest):
        rows.append(Quirk(name, drive, **rest))

    def refused(name, *drive, words, **rest):
        rows.append(Quirk(name, drive, refused=tuple(words), **rest))

    def stops(name, *drive, fault, **rest):
        rows.append(Quirk(name, drive, fault=fault, **rest))

    # ---- Objects that it hasn't got. CiA 402 has them as optional, and CiA 301 1006h, 1029h, 1400h:05.
    runs("no 6007h", "lacks=0x600700", lacks=("no 6007h:00",))
    runs("no RPDO timer", "lacks=0x140005", lacks=("no 1400h:05",))
    runs("no following error window", "lacks=0x606500", lacks=("no 6065h:00",))
    runs("no following error time", "lacks=0x606600")
    runs("no 1006h", "lacks=0x100600")
    runs("no 1029h", "lacks=0x102901")
    runs("no quick stop option", "lacks=0x605A00")
    runs("no fault reaction option", "lacks=0x605E00")
    runs("no ramps", "lacks=0x608400", "lacks=0x608500")
    runs("no revision number", "lacks=0x101803")
    refused("no heartbeat consumer", "lacks=0x101601", words=("1016h:01", "06090011", "stops_by: setpoint_timer"))
    runs("no heartbeat consumer, as the cell says", "lacks=0x101601", cell=("bring_up: {stops_by: setpoint_timer}",))
    runs("life guarding alone, as the cell says", "lacks=0x101601", "lacks=0x140005",
         cell=("bring_up: {stops_by: life_guarding}",), arguments=("--timestep", "2ms"))
    refused("no life guarding, though the cell says so", "lacks=0x101601", "lacks=0x100C00",
            cell=("bring_up: {stops_by: life_guarding}",), words=("100Ch:00",), arguments=("--timestep", "2ms"))
    refused("nothing that would stop it", "lacks=0x101601", "lacks=0x140005",
            cell=("bring_up: {stops_by: setpoint_timer}",), words=("1400h:05",))
    refused("no heartbeat producer", "lacks=0x101700", words=("1017h:00",))
    refused("no supported modes", "lacks=0x650200", words=("6502h:00",))
    refused("no interpolation period", "lacks=0x60C201", words=("60C2h:01",))
    refused("no actual position", "lacks=0x606400", words=("1A00h:02", "6064"))

    # ---- Objects that it has as its maker left them: fine where they fit.
    runs("period index read-only at what is needed", "holds=0x60C202:0xFD", "fixed=0x60C202", lacks=("60C2h:02",))
    refused("period read-only at 2 ms", "holds=0x60C201:2", "fixed=0x60C201", words=("60C2h:01", "0x02 (2)"))
    runs("RPDO read-only and event-driven", "holds=0x140002:255", "fixed=0x140002",
         lacks=("1400h:02 is 0xFF (255)", "as soon as it comes"))
    runs("RPDO that refuses type 1 and is event-driven", "holds=0x140002:254", "refuses=0x140002",
         lacks=("1400h:02 is 0xFE (254)",))
    runs("RPDO read-only and acyclic", "holds=0x140002:0", "fixed=0x140002", lacks=("1400h:02",))
    refused("TPDO read-only and event-driven", "holds=0x180002:255", "fixed=0x180002",
            words=("1800h:02", "0xFF (255)"))
    refused("6007h read-only at no action", "holds=0x600700:0", "fixed=0x600700", words=("6007h:00", "0x0000 (0)"))
    runs("6007h read-only at fault", "holds=0x600700:1", "fixed=0x600700", lacks=("6007h:00 is 0x0001 (1)",))
    runs("mode read-only at what is needed", "holds=0x606000:8", "fixed=0x606000", lacks=("6060h:00",))
    refused("mode read-only at another", "holds=0x606000:1", "fixed=0x606000", words=("6060h:00", "0x01 (1)"))
    refused("another device type", "device_type=0x00030192", words=("1000h:00", "0x00030192"))

    # ---- Values that it refuses. Of optional objects its own value stands, and that is said.
    for code in ("0x06090030", "0x06090031", "0x06090032", "0x08000000", "0x08000020", "0x08000021", "0x08000022"):
        runs(f"605Bh refused by {code}", f"refuses=0x605B00:{code}")
    for number in ("0x605B00", "0x606500", "0x608400", "0x100600", "0x140005"):
        name = f"{number[2:6]}h:{number[6:]}"
        runs(f"{name} refused by its value", f"refuses={number}", lacks=(f"{name} is 0x", "can't be set to"))
    refused("mode refused", "refuses=0x606000", words=("6060h:00", "06090030"))
    refused("mapping refused", "refuses=0x160001:0x06040041", words=("1600h:01", "06040041"))
    refused("heartbeat refused", "refuses=0x101601:0x08000022", words=("1016h:01", "08000022"))
    runs("1029h left alone, as the cell says", "refuses=0x102901:0x06040047",
         cell=('bring_up: {skip: [{object: "0x1029:01"}]}',), lacks=("1029h:01 isn't touched",))
    refused("1029h refused by an incompatibility", "refuses=0x102901:0x06040047", words=("1029h:01", "06040047"))

    # ---- The order in which it wants things.
    elsewhere = "holds=0x160001:0x60FF0020"  # what its RPDO carries as delivered: a velocity
    runs("mode before mapping, which is what is wanted as delivered", "mode_first", lacks=("1600h:01",))
    refused("mode before mapping", "mode_first", elsewhere, words=("1600h:01", "08000022"))
    runs("mode before mapping, as the cell says", "mode_first", elsewhere,
         cell=('bring_up: {write: [{object: "0x6060", bits: 8, value: 8}]}',))
    refused("mode shown late", "mode_late", words=("6061h:00", "0x00 (0)"))
    runs("mode shown late, as the cell says", "mode_late", cell=(DISPLAY, "bring_up: {mode_shown: enabled}"),
         arguments=("--timestep", "2ms"))
    stops("bit 4 wanted", "wants_bits=0x0010", fault="drive_not_enabled", words=("bit 12",))
    runs("bit 4 wanted, as the cell says", "wants_bits=0x0010", cell=("bring_up: {controlword_bits: 0x0010}",))
    runs("bits 4 to 6 wanted, as the cell says", "wants_bits=0x0070", cell=("bring_up: {controlword_bits: 0x0070}",))

    # ---- SDO answers. A request may wait 0.2 s for its answer and is sent three times; the first answer may take 2 s.
    runs("SDO answers 50 ms late", "sdo_late=50")
    runs("SDO answers 400 ms late, to the third request", "sdo_late=400")
    refused("SDO answers 700 ms late", "sdo_late=700", words=("node 1", "no answer"))
    runs("SDO answers 700 ms late, as the cell says", "sdo_late=700", cell=("bring_up: {answer_timeout_s: 1}",),
         own_process_only="its set-up takes two minutes of any clock")
    runs("stray SDO answers", "sdo_stray")
    runs("SDO answers without a size", "sdo_sizeless")
    runs("SDO answers twice", "sdo_doubled")
    runs("stray SDO answers, each twice and without a size", "sdo_stray", "sdo_doubled", "sdo_sizeless")
    refused("no SDO answers", "sdo", words=("node 1", "no answer"))
    refused("no word at all", "silent", words=("node 1", "no answer", "is it powered"))
    runs("SDO answers after 3 s, as the cell says", "sdo@0s..3s", cell=("bring_up: {start_timeout_s: 6}",))
    refused("SDO answers after 3 s", "sdo@0s..3s", words=("no answer",),
            own_process_only="when it is asked first is known there alone")

    # ---- NMT and heartbeats.
    runs("heartbeat whose bit 7 toggles", "guarding")
    refused("no heartbeat", "heartbeat", words=("node 1", "NMT state in its heartbeat"))
    runs("heartbeat that ends in motion, where TPDOs say more", "heartbeat@AT")
    stops("boot-up in motion", "boot_up@AT", fault="drive_fault", words=("restarted",), within_cycles=2)
    for stack in ("latching", "lazy", "holding", "insisting"):
        runs(f"{stack} stack", simulation=f"stack: {stack}")

    # ---- PDOs and SYNC in the cycle.
    runs("TPDO longer than its mapping", "tpdo_bytes=8@AT")
    stops("TPDO shorter than its mapping", "tpdo_bytes=4@AT", fault="drive_fault", words=("shorter",), within_cycles=2)
    stops("empty TPDO", "tpdo_bytes=0@AT", fault="drive_fault", words=("shorter",), within_cycles=2)
    runs("one SYNC in 50 not heard", "sync_lost=50@AT")
    stops("no SYNC heard by a drive that watches it", "sync_lost=1@AT", fault="drive_fault", words=("EMCY 8700",),
          within_cycles=6)
    stops("no SYNC heard by a drive that doesn't stop for it", "sync_lost=1@AT", simulation="stack: lazy",
          fault="drive_fault", words=("EMCY 8100",), within_cycles=6)
    stops("two of one node", "twin@AT", fault="drive_fault", words=("two drives answer",), within_cycles=14)
    stops("silent in motion", "silent@AT", fault="drive_silent", within_cycles=6)
    stops("power lost in motion", "power@AT", fault="drive_silent", within_cycles=6)

    # ---- EMCYs: those that say by themselves that the drive goes on, and all others.
    for code in ("0x8120", "0x8220", "0xFF01", "0x8110"):
        runs(f"EMCY {code} that stops nothing", f"warning={code}@AT")
    stops("EMCY of a temperature", "warning=0x4310@AT", fault="drive_fault", words=("EMCY 4310",), within_cycles=2)
    stops("trip with EMCY", "fault=0x7305@AT", fault="drive_fault", words=("EMCY 7305",), within_cycles=2)

    # ---- The state machine.
    stops("STO open at the start", "sto", fault="drive_not_enabled", words=("switch on disabled", "STO"))
    stops("STO opened in motion", "sto@AT", fault="drive_disabled", within_cycles=3)
    stops("bit 12 never", "bit12", fault="drive_not_enabled", words=("bit 12", "enable_timeout_s"))
    stops("mode changed by itself", "mode=1@AT", cell=(DISPLAY,), fault="drive_fault",
          words=("changed its mode",), within_cycles=3, arguments=("--timestep", "2ms"))
    runs("slow brake, as the cell says", simulation="brake_release_s: 6", cell=("bring_up: {enable_timeout_s: 12}",))
    stops("slow brake", simulation="brake_release_s: 6", fault="drive_not_enabled", words=("bit 12",))
    return rows


def texts(row, at_s):
    """The faults of a row, as --fault takes them."""
    return [word for text in row.drive for word in ("--fault", f"shoulder:{text.replace('AT', f'{at_s}s')}")]


def cell_of(row, text):
    """The bench's file with what the row says of its first drive."""
    lines = "".join(f"    {line}\n" for line in row.cell)
    text = text.replace("    device_type: 0x00020192\n", lines + "    device_type: 0x00020192\n", 1)
    if row.simulation:
        text = text.replace("    simulation:\n", f"    simulation:\n      {row.simulation}\n", 1)
    return text


def check(test, row, status, errors, summary, stopped_after_s, period_s):
    """`summary` of a session that began, else None; `stopped_after_s` from AT to the fault."""
    if row.refused:
        test.assertEqual(status, 2, errors)
        for word in row.refused:
            test.assertIn(word, errors)
        return
    test.assertIsNotNone(summary, errors)
    if not row.fault:
        test.assertEqual((status, summary["faults"]), (0, []), errors)
        for word in row.lacks:
            test.assertTrue(any(word in line for line in summary["drives_lack"]), summary["drives_lack"])
        return
    test.assertEqual(status, 1, errors)
    test.assertEqual([fault["fault"] for fault in summary["faults"]], [row.fault], summary["faults"])
    for word in (*row.words, "shoulder"):
        test.assertIn(word, summary["faults"][0]["text"])
    if row.within_cycles:
        test.assertGreaterEqual(stopped_after_s, 0.0)
        test.assertLessEqual(stopped_after_s, row.within_cycles * period_s)
