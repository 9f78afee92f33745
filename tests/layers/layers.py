"""Holds the rooms of server/ to the table of who may include and call whom.

usage: layers.py SOURCE_ROOT

A room may include itself, base/, the contract (protocol/) where the table says so, structs shared
with GLSL (shared/, kernel/), and the rooms that stand beside its name. Clients share a few of them. GL and EGL belong to gpu/ alone, SQLite
to the journal, and C++ to the shims around the parsers of glTF and of lossy EXR. Every file opens with a sentence that says what it is.
"""

import os
import re
import sys

# Lowest first. main.c may include everything.
ROOMS = {
    'base': [],
    'confine': [],
    'image': [],
    'scene': ['image'],  # the import child decodes textures
    'rays': ['scene', 'image'],
    'lights': ['scene'],  # those that have a size
    'gpu': [],
    'upload': ['scene', 'gpu'],
    'pass': ['upload', 'rays', 'lights', 'gpu', 'image'],  # the filter of light
    'technique': ['pass', 'gpu'],
    'frame': ['technique', 'pass', 'upload', 'rays', 'lights', 'scene', 'gpu', 'image', 'protocol'],
    'reference': ['scene', 'image'],
    'sched': ['frame', 'reference', 'scene', 'image'],
    'net': ['sched', 'frame', 'technique', 'scene', 'image', 'confine', 'protocol'],
}
# Rooms within a room, lowest first, with those that each may include; files beside them may include all.
SUB_ROOMS = {
    'scene': {
        'model': [],
        'mesh': ['model'],
        'gltf': ['mesh', 'model'],
        'edit': ['mesh', 'model'],
        'import': ['gltf', 'model'],
        'blobs': [],
        'journal': [],  # knows nothing of scenes
        'store': ['journal', 'model'],
    },
    'net': {
        'wire': [],  # messages: pure, any thread
        'loop': [],
        'access': ['loop'],
        'live': ['access', 'loop', 'wire'],
        'commit': ['live', 'loop'],
        'command': ['commit', 'live', 'access', 'loop', 'wire'],
        'session': ['command', 'live', 'access', 'loop', 'wire'],
        'http': ['session', 'command', 'live', 'access', 'loop', 'wire'],
    },
}
# Their doors: the headers that others include; those in brackets only from within the same room. The
# rest stays inside.
DOORS = {
    'scene/model': {'scene', 'object_fields', 'content', 'content_table', 'framing', 'render_space', 'triangle_order',
                    '(delta)', '(delta_parts)', '(derive)', '(flat)', '(primitive)'},
    'scene/mesh': {'(mesh)'},
    'scene/gltf': {'gltf_write', '(gltf)', '(import_input)', '(picture_queue)'},
    'scene/edit': {'edit', 'edit_kinds'},
    'scene/import': {'import'},
    'scene/blobs': {'blobs'},
    'scene/journal': {'data_dir', 'journal'},
    'scene/store': {'store', 'store_journal'},
    'net/wire': {'answer', 'edit_decode', 'frame_options', 'multipart', 'offers', 'scene_objects'},
    'net/loop': {'loop', 'serving', 'client', 'conn', 'background', 'spool', 'release', 'address', 'peer', 'steps'},
    'net/access': {'access', 'auth', 'author', 'cookie'},
    'net/live': {'live', 'view', 'watch', 'frame_job', 'frame_encode'},
    'net/commit': {'commits', 'commit', 'edit_queue', 'idle_commit', 'journal_turn'},
    'net/command': {'command', 'stats'},
    'net/session': {'session', 'framed'},
    'net/http': {'http'},
}
# What clients share with the daemon: rooms, and of one of them the journal and tables.
CLIENT_ROOMS = {'clients', 'base', 'image', 'protocol'}
CLIENT_HEADERS = {'scene/journal/journal.h', 'scene/edit/edit_kinds.h', 'scene/model/object_fields.h'}
# What the contract takes from the daemon: words that are a room's own.
PROTOCOL_ROOMS = {'base', 'protocol'}
PROTOCOL_HEADERS = {'image/tonemap.h'}
GL = re.compile(r'^(epoxy|GL|GLES\d?|EGL|KHR|gbm)/|^(gbm|glvnd).*\.h$')
SQLITE = re.compile(r'^sqlite3(ext)?\.h$')
JOURNAL = re.compile(r'^server/scene/journal/[a-z_]*\.[ch]$')
# Decoders of what strangers send: of the daemon only the import child's side names them, so that no
# byte of a client's picture is looked at in the daemon's own process.
DECODERS = {
    'image/decode.h': {'server/image/decode.c', 'server/image/shown.c', 'server/scene/import/import_child.c',
                       'server/scene/gltf/picture_queue.c'},
    'image/shown.h': {'server/image/shown.c'},  # for clients
    'scene/import/sky_map.h': {'server/scene/import/sky_map.c', 'server/scene/import/import_child.c', 'server/scene/import/import.c',
                        'server/scene/gltf/gltf_environment.c'},
    'scene/gltf/picture_queue.h': {'server/scene/gltf/picture_queue.c', 'server/scene/import/import_child.c', 'server/scene/gltf/gltf.c',
                              'server/scene/gltf/gltf_reader.h'},
    'scene/gltf/gltf.h': {'server/scene/gltf/gltf.c', 'server/scene/import/import_child.c'},
}
# Functions of ours, at the beginning of a line.
DECLARATION = re.compile(r'^(?!static|typedef)[a-z][\w \*]*?\b(bd_\w+)\([^;{}]*\)(?: BD_\w+\([^)]*\))?;', re.M)
DEFINITION = re.compile(r'^(?!static)[a-z][\w \*]*?\b(bd_\w+)\([^;{}]*\)\n\{', re.M)
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
# The C++ files.
CPP_SHIM = re.compile(r'^server/(scene/[a-z_/]*gltf[a-z_]*|image/exr_lossy)\.(cc|cpp)$')


def sources(root, folder):
    for path, _, names in os.walk(os.path.join(root, folder)):
        for name in sorted(names):
            if name.endswith(('.c', '.h', '.cc', '.cpp', '.cxx', '.hpp')):
                yield os.path.relpath(os.path.join(path, name), root)


def includes(root, path):
    with open(os.path.join(root, path), encoding='utf-8') as file:
        for number, line in enumerate(file, 1):
            found = INCLUDE.match(line)
            if found:
                yield number, found[1] == '"', found[2]


def sub_room_of(path):
    """"wire" of "net/wire/answer.h"; "" of what lies beside the sub-rooms, and of rooms that have none."""
    parts = path.split('/')
    return parts[1] if len(parts) > 2 and parts[0] in SUB_ROOMS else ''


def check_sub_include(room, own, name):
    """The same of sub-rooms, `own` being that of the file."""
    target = sub_room_of(name)
    if own and name.split('/')[0] == room and target not in (own, *SUB_ROOMS[room][own]):
        return f'{room}/{own}/ may not include {room}/{target or "what lies above it"}'
    door = DOORS.get(f'{name.split("/")[0]}/{target}')
    stem = os.path.splitext(os.path.basename(name))[0]
    inner = name.split('/')[0] == room and f'({stem})' in (door or ())
    if target and (name.split('/')[0], target) != (room, own) and stem not in door and not inner:
        return f'{name} stays in its room'
    return None


def check_room_include(room, own, name):
    """What is wrong with an include of `name` by `room`; None if nothing."""
    target = name.split('/')[0]
    if '/' not in name:
        return 'is named without its room'
    if target in SUB_ROOMS and check_sub_include(room, own, name):
        return check_sub_include(room, own, name)
    if target in (room, 'base', 'shared', 'kernel'):
        return None
    if target not in ROOMS and target != 'protocol':
        return f'{target}/ is no room'
    if target not in ROOMS[room]:
        return f'{room}/ may not include {target}/'
    return None


def check_client_include(name):
    if name.split('/')[0] in CLIENT_ROOMS or name in CLIENT_HEADERS:
        return None
    return 'is the daemon\'s own'


def check_protocol_include(name):
    if name.split('/')[0] in PROTOCOL_ROOMS or name in PROTOCOL_HEADERS:
        return None
    return 'the contract knows no room above it'


def room_of(path):
    """"net/wire" of "server/net/wire/answer.c", "gpu" of "server/gpu/list.c"."""
    inside = os.path.dirname(os.path.relpath(path, 'server')).split('/')
    return '/'.join(inside[:2] if inside[0] in SUB_ROOMS else inside[:1])


def check_calls(root):
    """What a room's header declares, that room defines: so calls go the ways of includes."""
    declared, defined = {}, {}
    for path in sources(root, 'server'):
        with open(os.path.join(root, path), encoding='utf-8') as file:
            text = file.read()
        found, into = (DECLARATION, declared) if path.endswith('.h') else (DEFINITION, defined)
        for name in found.findall(text):
            into.setdefault(name, set()).add(path)
    for name, headers in sorted(declared.items()):
        homes = {room_of(path) for path in defined.get(name, ())}
        for header in sorted(headers):
            if homes and room_of(header) not in homes:
                yield f'{header}: {name} is defined in {", ".join(sorted(homes))}'


def check_file(root, path):
    parts = path.split(os.sep)
    room = parts[1] if parts[0] == 'server' and len(parts) > 2 else None
    if room and room not in ROOMS:
        yield f'{path}: server/{room}/ is no room of the table'
        return
    for number, quoted, name in includes(root, path):
        if GL.match(name) and room != 'gpu':
            yield f'{path}:{number}: <{name}>: only server/gpu/ includes GL or EGL'
        elif SQLITE.match(name) and not JOURNAL.match(path):
            yield f'{path}:{number}: <{name}>: only the journal includes SQLite'
        elif quoted and room and path not in DECODERS.get(name, {path}):
            yield f'{path}:{number}: "{name}": only the import child decodes what clients send'
        elif quoted and room:
            wrong = check_room_include(room, sub_room_of('/'.join(parts[1:])), name)
            if wrong:
                yield f'{path}:{number}: "{name}": {wrong}'
        elif quoted and parts[0] in ('clients', 'protocol'):
            wrong = {'clients': check_client_include, 'protocol': check_protocol_include}[parts[0]](name)
            if wrong:
                yield f'{path}:{number}: "{name}": {wrong}'


def check_opening(root, path):
    """A file's first line says what it is; of a .c with a header, the header's does."""
    if os.path.exists(os.path.join(root, os.path.splitext(path)[0] + '.h')) and path.endswith('.c'):
        return
    with open(os.path.join(root, path)) as file:
        if not re.match(r'(//|"""|/\*)', file.read(3)):
            yield f'{path}:1: no sentence says what this file is'


def check_tree(root):
    faults = []
    for folder in ('server', 'clients', 'protocol', 'shaders'):
        for path in sources(root, folder):
            faults.extend(check_file(root, path))
            faults.extend(check_opening(root, path))
            cpp = path.endswith(('.cc', '.cpp', '.cxx', '.hpp'))
            if cpp and not CPP_SHIM.match(path):
                faults.append(f'{path}: C++ belongs to the shims around glTF and lossy EXR')
    return faults + list(check_calls(root))


def main():
    root = sys.argv[1]
    faults = check_tree(root)
    seen = sum(1 for _ in sources(root, 'server'))
    print('\n'.join(faults) if faults else f'{seen} files of server/ keep to their rooms')
    # A walk that finds nothing would find no fault either.
    return 1 if faults or seen < 10 else 0


sys.exit(main())
