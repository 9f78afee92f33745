# What a relocatable folder is made of: the shared libraries of programs, their licences, launchers.
# Sourced by bundle and gpu_day, not run. $stage is the folder: lib/, lib/runtime/, lib/fallback/,
# licenses/ in it are there already.

fallbacks=(libEGL.so.1 libOpenGL.so.0 libGLdispatch.so.0)

# libc's own libraries must be the host's: the loader that starts the program is. The driver and
# its finders must be, too.
is_hosts() {
  case $1 in
  ld-linux*.so* | libc.so* | libm.so* | libdl.so* | libpthread.so* | librt.so* | libresolv.so* | \
    libnss_*.so* | libutil.so* | libEGL*.so* | libGL*.so* | libOpenGL.so* | libgbm.so* | \
    libdrm*.so* | linux-vdso.so*) return 0 ;;
  esac
  return 1
}

# The C++ runtime, and what else a driver written in C++ shares with us.
is_runtime() {
  case $1 in libstdc++.so.6 | libgcc_s.so.1 | libz.so.1) return 0 ;; esac
  return 1
}

# Copies what the file needs, and what that needs: ldd has followed it all.
copy_needed() { # file
  local soname path folder
  ldd "$1" | awk '$2 == "=>" && $3 ~ /^\// {print $1, $3} $0 ~ /not found/ {print $1, "-"}' |
    while read -r soname path; do
      is_hosts "$soname" && continue
      [ "$path" != - ] || { echo "$1 needs $soname, which is not here" >&2; exit 1; }
      folder=$stage/lib
      is_runtime "$soname" && folder=$stage/lib/runtime
      [ -e "$folder/$soname" ] || install -m 644 "$(realpath "$path")" "$folder/$soname"
      copy_license "$path"
    done
}

copy_license() { # library
  local package
  package=$(dpkg-query -S "$(realpath "$1")" 2>/dev/null | head -n 1 | cut -d: -f1) || return 0
  [ -n "$package" ] && [ -e "/usr/share/doc/$package/copyright" ] || return 0
  [ -e "$stage/licenses/$package" ] || cp -L "/usr/share/doc/$package/copyright" "$stage/licenses/$package"
}

library_path() { # soname
  ldconfig -p | awk -v name="$1" '$1 == name && /x86-64|AArch64/ {print $NF; exit}'
}

copy_fallbacks() {
  local soname
  for soname in "${fallbacks[@]}"; do
    install -m 644 "$(realpath "$(library_path "$soname")")" "$stage/lib/fallback/$soname"
    copy_license "$(library_path "$soname")"
  done
}

# bin/NAME starts libexec/NAME (launcher.c).
build_launchers() { # names...
  local symbol newest name
  newest=$(nm -D --defined-only "$stage/lib/runtime/libstdc++.so.6" |
    sed -n 's/.* \(_Z[^@]*\)@@\(GLIBCXX_3[0-9.]*\)$/\2 \1/p' | sort -V | tail -n 1)
  symbol=${newest#* } newest=${newest% *}
  for name in "$@"; do
    gcc -std=c17 -D_GNU_SOURCE -O2 -Wall -Wextra -Werror -DBD_RUNTIME_SYMBOL="\"$symbol\"" \
      -DBD_RUNTIME_VERSION="\"$newest\"" deploy/launcher.c -o "$stage/bin/$name"
  done
}

# Programs and libraries find what they need by where they lie themselves.
set_rpath() { # files...
  local file
  for file in "$@"; do
    patchelf --set-rpath "\$ORIGIN/$(realpath --relative-to "$(dirname "$file")" "$stage/lib")" "$file"
  done
}

# The same tree to the same bytes. git knows when it was made.
tar_of() { # folder, name in it
  tar --sort=name --owner=0 --group=0 --numeric-owner \
    --mtime="@${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}" -C "$1" -cf - "$2"
}

check_size() { # file, limit in MiB
  local size_bytes
  size_bytes=$(stat -c %s "$1")
  printf '%s: %.1f MiB\n' "$1" "$(awk "BEGIN {print $size_bytes / 1048576}")"
  [ "$size_bytes" -le $(($2 * 1048576)) ] || { echo "above the limit of $2 MiB" >&2; exit 1; }
}
