"""Writes the files of the viewer as a C table (server/net/http/viewer.h).

usage: embed.py SHADERS OUT.c OUT.d FOLDER

SHADERS holds the other embed.py, which knows how bytes are written.
"""

import hashlib
import os
import sys

TYPES = {
    '.html': 'text/html; charset=utf-8',
    '.js': 'text/javascript; charset=utf-8',
    '.css': 'text/css; charset=utf-8',
    '.svg': 'image/svg+xml',
    '.txt': 'text/plain; charset=utf-8',
}


def table(folder, c_bytes):
    """(C source, the files that it was made of)"""
    arrays, rows, paths = [], [], []
    for name in sorted(os.listdir(folder)):
        path = os.path.join(folder, name)
        with open(path, 'rb') as file:
            data = file.read()
        media_type = TYPES.get(os.path.splitext(name)[1])
        if not media_type or not data:
            sys.exit(f'{path}: empty, or of a kind that has no media type here')
        url = '/' if name == 'index.html' else '/' + name
        etag = hashlib.sha256(data).hexdigest()[:32]
        symbol = f'file_{len(paths)}'
        arrays.append(f'static const uint8_t {symbol}[] = {{\n{c_bytes(data)}}};\n')
        rows.append(f'    {{"{url}", "{media_type}", "\\"{etag}\\"", {symbol}, sizeof {symbol}}},\n')
        paths.append(path)
    source = ('#include "net/http/viewer.h"\n' + ''.join(arrays) +
              'const struct bd_viewer_file bd_viewer_files[] = {\n' + ''.join(rows) +
              f'}};\nconst uint32_t bd_viewer_file_count = {len(rows)};\n')
    return source, paths


def main():
    shaders, out_c, out_d, folder = sys.argv[1:]
    sys.path.insert(0, shaders)
    sys.dont_write_bytecode = True
    from embed import c_bytes
    source, paths = table(folder, c_bytes)
    with open(out_c, 'w', encoding='ascii') as out:
        out.write(source)
    with open(out_d, 'w', encoding='utf-8') as out:
        out.write(f'{out_c}: ' + ' '.join(p.replace(' ', '\\ ') for p in [folder, *paths]) + '\n')


main()
