"""The machine that a leg runs on: what it is, and where its graphics driver is."""
import ctypes
import json
import os
import pathlib
import platform
import subprocess

# Where glvnd looks by itself, and where a driver that was mounted into a container says what it is.
VENDOR_FOLDERS = ("/usr/share/glvnd/egl_vendor.d", "/etc/glvnd/egl_vendor.d")
MOUNTED_FOLDERS = ("/usr/local/nvidia/share/glvnd/egl_vendor.d",)
MOUNTED_LIBRARIES = ("/usr/local/nvidia/lib64", "/usr/local/nvidia/lib")
VENDOR_LIBRARY = "libEGL_nvidia.so.0"


def _described(folders):
    return sorted(str(path) for folder in folders for path in pathlib.Path(folder).glob("*.json"))


def _loads(library):
    try:
        ctypes.CDLL(library)
        return True
    except OSError:
        return False


def driver_environment(scratch, environment):
    """What has to be set so that EGL finds the driver; nothing where it does by itself."""
    found = {}
    folder = next((f for f in MOUNTED_LIBRARIES if os.path.exists(f"{f}/{VENDOR_LIBRARY}")), None)
    if folder and not _loads(VENDOR_LIBRARY):
        given = environment.get("LD_LIBRARY_PATH")
        found["LD_LIBRARY_PATH"] = f"{given}:{folder}" if given else folder
    if "__EGL_VENDOR_LIBRARY_FILENAMES" in environment or _described(VENDOR_FOLDERS):
        return found
    described = _described(MOUNTED_FOLDERS)
    if not described and (folder or _loads(VENDOR_LIBRARY)):
        own = scratch / "10_nvidia.json"
        own.write_text(json.dumps({"file_format_version": "1.0.0",
                                   "ICD": {"library_path": VENDOR_LIBRARY}}))
        described = [str(own)]
    if described:
        found["__EGL_VENDOR_LIBRARY_FILENAMES"] = ":".join(described)
    return found


def _said(words, environment=None):
    """What a command prints; None where there is no such command or it fails."""
    try:
        ran = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False,
                             env=environment)
    except (OSError, subprocess.SubprocessError):
        return None
    return ran.stdout if ran.returncode == 0 else None


def _line(path, key):
    """What stands behind `key` in a file of lines; None where there is none."""
    try:
        lines = pathlib.Path(path).read_text(encoding="utf-8").splitlines()
    except OSError:
        return None
    found = next((line for line in lines if line.startswith(key)), "")
    return found[len(key):].strip(" \t:=\"") or None


def facts(bounced, environment):
    """JSON: machine, driver, and every device that bounced finds."""
    devices = _said([bounced, "--list-devices", "--log", "json"], environment)
    try:
        version = pathlib.Path("/proc/driver/nvidia/version").read_text(encoding="utf-8").strip()
    except OSError:
        version = None
    return {"machine": {"cpu": _line("/proc/cpuinfo", "model name"), "cores": os.cpu_count(),
                        "memory": _line("/proc/meminfo", "MemTotal"), "kernel": platform.release(),
                        "system": _line("/etc/os-release", "PRETTY_NAME"),
                        "libc": " ".join(platform.libc_ver()), "load_before": os.getloadavg()[0]},
            "build": (_said([bounced, "--version"]) or "").strip(),
            "driver": version, "nvidia_smi": _said(["nvidia-smi", "-q", "-d", "MEMORY,CLOCK,POWER,COMPUTE"]),
            "devices": json.loads(devices) if devices else []}
