"""EDS and DCF files of a CiA 402 drive in three makers' handwritings; all words and numbers are our own.

OBJECTS is the dictionary that such a drive has: what the profile asks for and what makers add to it.
"""

U8, U16, U32, I8, I16, I32, REAL, TEXT, DOMAIN = 0x05, 0x06, 0x07, 0x02, 0x03, 0x04, 0x08, 0x09, 0x0F


def usual():
    """(index, sub): (name, data type, access, mappable, default); None: no default."""
    table = {
        (0x1000, 0): ("Device Type", U32, "ro", 0, "0x00420192"),
        (0x1001, 0): ("Error Register", U8, "ro", 1, None),
        (0x1005, 0): ("COB-ID SYNC", U32, "rw", 0, "0x00000080"),
        (0x1006, 0): ("Cycle Period", U32, "rw", 0, "0"),
        (0x1008, 0): ("Device Name", TEXT, "const", 0, "Axis Amplifier"),
        (0x1014, 0): ("COB-ID EMCY", U32, "ro", 0, "$NODEID+0x80"),
        (0x1016, 0): ("Highest Sub-index", U8, "ro", 0, "1"),
        (0x1016, 1): ("Watched Heartbeat", U32, "rw", 0, "0"),
        (0x1017, 0): ("Heartbeat Period", U16, "rw", 0, "0"),
        (0x1018, 0): ("Highest Sub-index", U8, "ro", 0, "4"),
        (0x1018, 1): ("Vendor", U32, "ro", 0, None),
        (0x1018, 2): ("Product", U32, "ro", 0, None),
        (0x1018, 3): ("Revision", U32, "ro", 0, None),
        (0x1018, 4): ("Serial", U32, "ro", 0, None),
        (0x1029, 0): ("Highest Sub-index", U8, "ro", 0, "1"),
        (0x1029, 1): ("Communication Error", U8, "rw", 0, "1"),
        (0x2001, 0): ("Bus Voltage Scale", REAL, "rw", 0, "12.5"),
        (0x2010, 0): ("Firmware", DOMAIN, "wo", 0, None),
        (0x6007, 0): ("Abort Connection", I16, "rw", 0, "1"),
        (0x603F, 0): ("Error Code", U16, "ro", 1, None),
        (0x6040, 0): ("Controlword", U16, "rww", 1, "0"),
        (0x6041, 0): ("Statusword", U16, "ro", 1, None),
        (0x605A, 0): ("Quick Stop Option", I16, "rw", 0, "2"),
        (0x605E, 0): ("Fault Reaction Option", I16, "rw", 0, "2"),
        (0x6060, 0): ("Mode", I8, "rww", 1, "1"),
        (0x6061, 0): ("Mode Display", I8, "ro", 1, None),
        (0x6064, 0): ("Position", I32, "ro", 1, None),
        (0x6065, 0): ("Following Window", U32, "rw", 0, "2000"),
        (0x6066, 0): ("Following Time", U16, "rw", 0, "50"),
        (0x6077, 0): ("Torque", I16, "ro", 1, None),
        (0x607A, 0): ("Target", I32, "rww", 1, "0"),
        (0x6084, 0): ("Slow Down", U32, "rw", 0, "10000"),
        (0x6085, 0): ("Quick Stop Ramp", U32, "rw", 0, "50000"),
        (0x60C2, 0): ("Highest Sub-index", U8, "ro", 0, "2"),
        (0x60C2, 1): ("Interpolation Value", U8, "rw", 0, "1"),
        (0x60C2, 2): ("Interpolation Index", I8, "rw", 0, "-3"),
        (0x6502, 0): ("Supported Modes", U32, "ro", 0, "0x000003E5"),
    }
    for n in range(4):
        for direction, base, first in (("RPDO", 0x1400, 0x200), ("TPDO", 0x1800, 0x180)):
            offset = first + 0x100 * n + (0 if n == 0 else 0x80000000)
            table[(base + n, 0)] = ("Highest Sub-index", U8, "ro", 0, "5")
            table[(base + n, 1)] = (f"{direction} COB-ID", U32, "rw", 0, f"$NODEID+0x{offset:X}")
            table[(base + n, 2)] = (f"{direction} Type", U8, "rw", 0, "255")
            table[(base + n, 3)] = (f"{direction} Inhibit Time", U16, "rw", 0, "0")
            table[(base + n, 5)] = (f"{direction} Event Timer", U16, "rw", 0, "0")
            table[(base + 0x200 + n, 0)] = (f"{direction} Mapping Count", U8, "rw", 0, "1")
            word = "0x60400010" if direction == "RPDO" else "0x60410010"
            for sub in range(1, 9):
                table[(base + 0x200 + n, sub)] = (f"{direction} Mapping {sub}", U32, "rw", 0, word if sub == 1 else "0")
    return table


def section(index, sub, has_subs):
    return f"{index:04X}sub{sub:X}" if has_subs else f"{index:04X}"


def grouped(table):
    groups = {}
    for (index, sub), entry in sorted(table.items()):
        groups.setdefault(index, []).append((sub, entry))
    return groups


def is_compound(entries):
    return len(entries) > 1 or entries[0][0] != 0


def plain(table, device=("0x0000ABCD", "0x00000815", "0x00020003")):
    """As an editor writes it: hexadecimal types, a section for each sub-object, limits left empty."""
    lines = ["[FileInfo]", "FileName=axis.eds", "EDSVersion=4.0", "", "[DeviceInfo]", "VendorName=A Maker",
             f"VendorNumber={device[0]}", f"ProductNumber={device[1]}", f"RevisionNumber={device[2]}",
             "BaudRate_500=1", "BaudRate_1000=1", "NrOfRXPDO=4", "NrOfTXPDO=4", "", "[MandatoryObjects]",
             "SupportedObjects=1", "1=0x1000", ""]
    for index, entries in grouped(table).items():
        compound = is_compound(entries)
        if compound:
            lines += [f"[{index:04X}]", f"ParameterName=Group {index:04X}", "ObjectType=0x9",
                      f"SubNumber=0x{len(entries):X}", ""]
        for sub, (name, kind, access, mappable, default) in entries:
            lines += [f"[{section(index, sub, compound)}]", f"ParameterName={name}", "ObjectType=0x7",
                      f"DataType=0x{kind:04X}", "LowLimit=", "HighLimit=", f"AccessType={access}",
                      f"DefaultValue={default or ''}", f"PDOMapping={mappable}", ""]
    return "\n".join(lines)


def shouting(table, device=("51966", "7", "65537")):
    """Keys and sections in capitals, decimal numbers, blanks about '=', comments behind values, real limits, DOS line ends."""
    lines = ["; written by hand", "[FILEINFO]", "FILENAME = AXIS.EDS", "", "[DEVICEINFO]", f"VENDORNUMBER = {device[0]}",
             f"PRODUCTNUMBER = {device[1]}", f"REVISIONNUMBER = {device[2]} ; 1.1", "BAUDRATE_1000 = 1", "",
             "[COMMENTS]", "LINES = 1", "LINE1 = this drive is set by its maker's tool", ""]
    limits = {I8: (-128, 127), I16: (-32768, 32767), I32: (-2147483648, 2147483647), U8: (0, 255), U16: (0, 65535),
              U32: (0, 4294967295)}
    for index, entries in grouped(table).items():
        compound = is_compound(entries)
        if compound:
            lines += [f"[{index:04X}]", f"PARAMETERNAME = G{index:04X}", "OBJECTTYPE = 8", f"SUBNUMBER = {len(entries)}", ""]
        for sub, (name, kind, access, mappable, default) in entries:
            lines += [f"[{section(index, sub, compound).upper()}]", f"PARAMETERNAME = {name.upper()}", "OBJECTTYPE = 7",
                      f"DATATYPE = {kind}", f"ACCESSTYPE = {access.upper()}", f"PDOMAPPING = {mappable}"]
            if default is not None:
                lines.append(f"DEFAULTVALUE = {default.replace('$NODEID+', '') + ' + $NodeId' if '$' in default else default}")
            if kind in limits and index >= 0x2000:
                lines += [f"LOWLIMIT = {limits[kind][0]}", f"HIGHLIMIT = {limits[kind][1]}"]
            lines.append("")
    return "\r\n".join(lines)


def dense(table, device=("0x3E9", "0x1", "0x0")):
    """A DCF without blank lines, lower case, compact sub-objects where they are alike, defaults left out, values set."""
    lines = ["[fileinfo]", "filename=axis.dcf", "lasteds=axis.eds", "[deviceinfo]", f"vendornumber={device[0]}",
             f"productnumber={device[1]}", f"revisionnumber={device[2]}", "baudrate_1000=0x1", "[devicecomissioning]",
             "nodename=axis", "baudrate=1000", "[dummyusage]", "dummy0005=1"]
    for index, entries in grouped(table).items():
        compound = is_compound(entries)
        if 0x1600 <= index < 0x1800 or 0x1A00 <= index < 0x1C00:
            access = entries[0][1][2]
            lines += [f"[{index:04x}]", "parametername=mapping", "objecttype=0x9", "compactsubobj=8", "datatype=0x7",
                      f"accesstype={access}", "pdomapping=0"]
            lines += [f"[{index:04x}sub0]", "parametername=count", "objecttype=0x7", "datatype=0x5", f"accesstype={access}",
                      "defaultvalue=0", "pdomapping=0"]
            continue
        if compound:
            lines += [f"[{index:04x}]", f"parametername=g{index:04x}", "objecttype=0x9", f"subnumber={len(entries)}"]
        for sub, (name, kind, access, mappable, default) in entries:
            lines += [f"[{section(index, sub, compound).lower()}]", f"parametername={name.lower()}", "objecttype=0x7",
                      f"datatype=0x{kind:x}", f"accesstype={access}", f"pdomapping={mappable}"]
            if default is not None and not (index < 0x1400 and default == "0"):
                lines.append(f"defaultvalue={default}")
            if index == 0x2001:
                lines.append("parametervalue=0x41200000")
    return "\n".join(lines) + "\n"


STYLES = {"plain.eds": plain, "shouting.eds": shouting, "dense.dcf": dense}
