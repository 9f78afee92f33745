"""Reads off programs what the compiler and the linker were asked for.

usage: hardening.py [--sanitized] PROGRAM...

ELF for 64-bit machines, read by itself: what a program says of itself, its symbols and, on x86-64, how
its functions begin. A sanitizer's build has no fortified calls and lays out its own protections.
"""
import pathlib
import struct
import sys

PT_DYNAMIC, PT_INTERP, PT_GNU_STACK, PT_GNU_RELRO, PT_GNU_PROPERTY = (
    2, 3, 0x6474e551, 0x6474e552, 0x6474e553)
PF_X, PF_W = 1, 2
ET_DYN, EM_X86_64 = 3, 62
DT_FLAGS, DT_FLAGS_1, DT_TEXTREL, DT_RPATH, DT_RUNPATH = 30, 0x6ffffffb, 22, 15, 29
DF_BIND_NOW, DF_1_NOW, DF_1_PIE = 8, 1, 0x08000000
SHT_SYMTAB, SHT_DYNSYM = 2, 11
STT_FUNC = 2
FEATURE_1_AND, SHSTK = 0xc0000002, 2
ENDBR64 = b"\xf3\x0f\x1e\xfa"
# Of ours that others call by address or from other files; nearly all may be, some are inlined whole.
LANDING_SHARE = .9


class Elf:
    def __init__(self, content):
        self.content = content
        if content[:5] != b"\x7fELF\x02":
            raise ValueError("no 64-bit ELF file")
        (self.kind, self.machine, _, _, segments, sections, _, _, size, count, ssize, scount, _) = (
            struct.unpack_from("<HHIQQQIHHHHHH", content, 16))
        self.segments = [struct.unpack_from("<IIQQQQQQ", content, segments + i * size)
                         for i in range(count)]
        self.sections = [struct.unpack_from("<IIQQQQIIQQ", content, sections + i * ssize)
                         for i in range(scount)]

    def segment(self, kind):
        return next((s for s in self.segments if s[0] == kind), None)

    def dynamic(self):
        """{tag: value}"""
        _, _, offset, _, _, size, _, _ = self.segment(PT_DYNAMIC)
        return dict(struct.iter_unpack("<qQ", self.content[offset:offset + size]))

    def symbols(self):
        """(name, kind, value, section) of everything that is named."""
        for section in self.sections:
            if section[1] not in (SHT_SYMTAB, SHT_DYNSYM):
                continue
            names = self.sections[section[6]][4]
            for at in range(section[4], section[4] + section[5], 24):
                name, info, _, index, value, _ = struct.unpack_from("<IBBHQQ", self.content, at)
                end = self.content.index(b"\0", names + name)
                yield self.content[names + name:end].decode(), info & 15, value, index

    def at(self, address, size):
        """What lies at an address of the running program."""
        for kind, _, offset, start, _, length, _, _ in self.segments:
            if kind == 1 and start <= address < start + length:
                return self.content[offset + address - start:][:size]
        return b""

    def features(self):
        """The x86 features that every part of the program keeps to."""
        segment = self.segment(PT_GNU_PROPERTY)
        if not segment:
            return 0
        note = self.content[segment[2]:segment[2] + segment[5]]
        at = 16  # behind the note's head and its name, "GNU"
        while at + 8 <= len(note):
            kind, size = struct.unpack_from("<II", note, at)
            if kind == FEATURE_1_AND:
                return struct.unpack_from("<I", note, at + 8)[0]
            at += 8 + (size + 7) // 8 * 8
        return 0


def landing_share(elf, names):
    """Of our functions, how many begin with a landing pad."""
    ours = {value for name, kind, value, index in names
            if kind == STT_FUNC and index and name.startswith("bd_") and "." not in name}
    if not ours:
        return 0.0
    return sum(elf.at(address, 4) == ENDBR64 for address in ours) / len(ours)


def faults(elf, is_sanitized):
    """What is missing, in words."""
    dynamic, names = elf.dynamic(), list(elf.symbols())
    imported = {name.split("@")[0] for name, _, _, index in names if index == 0}
    stack, segments = elf.segment(PT_GNU_STACK), elf.segments
    is_x86 = elf.machine == EM_X86_64
    checks = (
        ("not position-independent", elf.kind == ET_DYN and dynamic.get(DT_FLAGS_1, 0) & DF_1_PIE),
        ("no read-only relocations", elf.segment(PT_GNU_RELRO)),
        ("symbols are bound late", dynamic.get(DT_FLAGS, 0) & DF_BIND_NOW
         or dynamic.get(DT_FLAGS_1, 0) & DF_1_NOW),
        ("an executable stack", stack and not stack[1] & PF_X),
        ("memory that is writable and executable",
         not any(s[0] == 1 and s[1] & PF_X and s[1] & PF_W for s in segments)),
        ("relocations in the code", DT_TEXTREL not in dynamic),
        ("no stack protector", "__stack_chk_fail" in imported),
        ("no fortified calls", is_sanitized or any(name.endswith("_chk") and name.startswith("__")
                                                   and name != "__stack_chk_fail" for name in imported)),
        # Who has containers imports what they throw, or their trees.
        ("no assertions in the C++ library's containers", not any("__throw_l" in n or "_Rb_tree" in n for n in imported)
         or any("__glibcxx_assert_fail" in name for name in imported)),
        ("no mark for shadow stacks", is_sanitized or not is_x86 or elf.features() & SHSTK),
        ("functions without landing pads", is_sanitized or not is_x86
         or landing_share(elf, names) >= LANDING_SHARE),
    )
    return [words for words, good in checks if not good]


def main(words):
    is_sanitized = words[:1] == ["--sanitized"]
    programs = words[is_sanitized:]
    bad = 0
    for program in programs:
        elf = Elf(pathlib.Path(program).read_bytes())
        found = faults(elf, is_sanitized)
        bad += len(found)
        print(f"{program}: {', '.join(found) or 'hardened'}")
    return 1 if bad or not programs else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
