# Debian 12 packages, for the scripts beside this file. Sourced, not run.

build_packages=(
  gcc g++ meson ninja-build pkg-config python3
  libembree-dev libepoxy-dev libjansson-dev libopenexr-dev libprotobuf-c-dev libseccomp-dev
  libspng-dev libsqlite3-dev libssl-dev libtinygltf-dev libturbojpeg0-dev libuv1-dev libwslay-dev libxxhash-dev
  node-llhttp protobuf-c-compiler
)
# A device for machines that have no GPU, and the library that finds either.
device_packages=(libegl1 libegl-mesa0 libgl1-mesa-dri libopengl0)
# What the commands of README.md need beside the programs. protoc makes the messages of the Python client.
use_packages=(curl python3-matplotlib python3-numpy python3-protobuf protobuf-compiler)
test_packages=(
  chromium clang libclang-rt-14-dev llvm glslang-tools haproxy libcmocka-dev curl systemd
  python3-matplotlib python3-numpy python3-pil python3-protobuf python3-pytest python3-websockets protobuf-compiler
)
# What deploy/gpu_day brings along of them.
day_python_packages=(python3-numpy python3-pil python3-protobuf python3-pytest)
# A tar and an unxz for machines that have neither.
day_packages=(busybox-static xz-utils)
# git knows when the tree was made.
bundle_packages=(git patchelf protobuf-compiler)

is_installed() {
  [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]
}

# Installs what is missing of its arguments, and says what. Needs root or sudo only then.
install_missing() {
  local missing=() package as_root=()
  for package in "$@"; do
    is_installed "$package" || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  command -v apt-get >/dev/null || {
    echo "this is no Debian; install what these packages hold: ${missing[*]}" >&2
    return 1
  }
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  echo "installing: ${missing[*]}"
  "${as_root[@]}" apt-get update -qq &&
    DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq \
      --no-install-recommends "${missing[@]}" >/dev/null
}
