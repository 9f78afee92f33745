"""Writes the shader files of some folders as a C table, and what the table was made of.

usage: embed.py OUT.c OUT.d FOLDER...

A file is named by its path below its folder. The depfile lists the files *and* the folders: a
folder's own time changes when an entry comes or goes, so a new shader is picked up by the next
build without configuring again.
"""

import os
import sys

SUFFIXES = ('.comp', '.vert', '.frag', '.glsl', '.h')


def collect(folders):
    """({name: path}, [everything that the result depends on])"""
    files, dependencies = {}, []
    for folder in folders:
        for path, folder_names, file_names in os.walk(folder):
            folder_names.sort()
            dependencies.append(path)
            for file_name in sorted(file_names):
                full = os.path.join(path, file_name)
                if not file_name.endswith(SUFFIXES):
                    continue
                name = os.path.relpath(full, folder)
                if name in files:
                    sys.exit(f'{full}: {files[name]} has that name already')
                files[name] = full
                dependencies.append(full)
    return files, dependencies


def c_bytes(data):
    """The bytes as an initialiser: string literals above 4095 characters are not portable C."""
    rows = (data[i:i + 24] for i in range(0, len(data), 24))
    return '\n'.join(','.join(map(str, row)) + ',' for row in rows)


def main():
    out_c, out_d, folders = sys.argv[1], sys.argv[2], sys.argv[3:]
    files, dependencies = collect(folders)
    names = sorted(files)
    with open(out_c, 'w', encoding='ascii') as out:
        out.write('#include "gpu/source.h"\n')
        for i, name in enumerate(names):
            with open(files[name], 'rb') as file:
                data = file.read()
            if any(byte > 126 for byte in data):
                sys.exit(f'{files[name]}: a character that is not ASCII; GLSL allows none')
            out.write(f'static const char file_{i}[] = {{\n{c_bytes(data)}0}};\n')
        out.write('const struct bd_shader_file bd_shader_files[] = {\n')
        for i, name in enumerate(names):
            out.write(f'    {{"{name}", file_{i}}},\n')
        out.write(f'}};\nconst uint32_t bd_shader_file_count = {len(names)};\n')
    with open(out_d, 'w', encoding='utf-8') as out:
        paths = ' '.join(path.replace(' ', '\\ ') for path in dependencies)
        out.write(f'{out_c}: {paths}\n')


if __name__ == '__main__':
    main()
